"""Message codes of the basic modules: files and arguments (NCF002 ... NCF025), plugins (NCF5xx)."""

from __future__ import annotations

from ncfix.diagnostics import Code

CODES = {
    "NCF002": Code(
        "an input file cannot be read",
        "The file does not exist, is a folder, or may not be read; the message contains the error of the system. "
        "ncfix reads no devices, no pipes without a writer, and not more than 1 GB as a whole or through a pipe. Or "
        "a long program was changed while it was corrected, so that its parts may not belong together.",
        "Check the path and the permissions.",
    ),
    "NCF003": Code(
        "no output given",
        "ncfix changes a program itself only with `--in-place`, and programs of a folder need a folder for the "
        "results.",
        "Give `-o FILE`, `-o FOLDER`, `-o -` for standard output, or `--in-place`, which keeps the original as "
        "FILE.orig.",
    ),
    "NCF004": Code(
        "the output already exists",
        "ncfix replaces a file only with `--force`.",
        "Choose another `-o`, or use `--force`.",
    ),
    "NCF005": Code(
        "an output that must not be written",
        "The output is an input, a symbolic link or not an ordinary file, or a folder in its path is a symbolic "
        "link. Writing it could destroy another file.",
        "Choose another `-o`; `--in-place` keeps the original; `-o -` is standard output.",
    ),
    "NCF007": Code(
        "the output cannot be written",
        "The disk is full, the folder is write-protected, or the system reports another error. An existing file is "
        "unchanged, and no incomplete file is left.",
        "Make room, or choose another `-o`.",
    ),
    "NCF020": Code(
        "an input given twice",
        "The same file is named twice, perhaps under two names. A measurement that counts twice seems more certain "
        "than it is.",
        "Name it once. A repeated measurement is another file, or has a column `repeat`.",
    ),
    "NCF023": Code(
        "a name that an output may not have",
        "Many controls run Windows. There `CON.nc` is the console, a full stop or blank at the end of a name is "
        "dropped, and `\\` or `:` in a name make it a path. Names with a control character, and names that lead out "
        "of the output folder, are not written either. This holds on all systems.",
        "Give the program, or the output, another name.",
    ),
    "NCF025": Code(
        "an invalid argument",
        "A function got a number outside its range, an unknown choice, or no value where one is needed. The command "
        "line refuses the same values of its options with NCF001.",
        "The hint of the message lists the possible values; docs/api.md shows examples.",
    ),
    "NCF501": Code(
        "a plugin cannot be imported",
        "Its entry point exists, but loading it failed. The plugin is left out; everything else works.",
        "Reinstall the plugin, uninstall it, or name it in NCFIX_DISABLE_PLUGINS. NCFIX_STRICT_PLUGINS=1 makes it an "
        "error.",
    ),
    "NCF502": Code(
        "a plugin has a hook that ncfix does not know",
        "A function is marked as a hook, but ncfix has no hook of this name or with these arguments: it is "
        "misspelled, or made for another version. The whole plugin is left out.",
        "`docs/plugins.md` lists the hooks and their arguments.",
    ),
    "NCF503": Code(
        "two plugins take the same name",
        "Each name of a dialect, a basis and so on can be registered once. The plugin that is loaded later is left "
        "out. Built-in plugins are loaded first, the others in the order of the names of their distributions.",
        "Uninstall one, or name it in NCFIX_DISABLE_PLUGINS.",
    ),
    "NCF504": Code(
        "a plugin failed while it registered",
        "A hook of the plugin raised an exception. The whole plugin is left out, including what it had already "
        "registered.",
        "Report it to its author; `ncfix plugins` lists what is loaded.",
    ),
    "NCF505": Code(
        "a plugin registers something without a name",
        "`register(thing)` files a thing under `thing.name`, which must be a text; others need `register(thing, "
        'name="...")`.',
        "Report it to its author.",
    ),
    "NCF506": Code(
        "a plugin without hooks",
        "The module has no function that is marked as a hook, or one with a hook's name that is not marked.",
        "Mark it with `@ncfix.hookspecs.hookimpl`.",
    ),
    "NCF507": Code(
        "a plugin failed",
        "The code of a plugin raised an unexpected exception. The fault is in the plugin, not in the input or in "
        "ncfix. Nothing was written.",
        "Report it to its author; `ncfix --debug` shows the traceback. NCFIX_DISABLE_PLUGINS leaves the plugin out.",
    ),
    "NCF508": Code(
        "a plugin registers something of the wrong kind",
        "It registered something that does not fit the hook, which is left out; or it returned something of the "
        "wrong type.",
        "Report it to its author; `docs/plugins.md` describes what each hook registers and returns.",
    ),
    "NCF509": Code(
        "a file of no known form",
        "`ncfix lint` recognises a table by its content. Its lines belong to no control of a plugin and to no other "
        "known form, or a damaged line hides the form.",
        "Name the control with `--control NAME`; `ncfix plugins` lists the controls.",
    ),
}
