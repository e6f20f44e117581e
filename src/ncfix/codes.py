"""Message codes of the basic modules: files and arguments (NCF002 ... NCF025), plugins (NCF5xx)."""

from __future__ import annotations

from ncfix.diagnostics import Code

CODES = {
    "NCF002": Code(
        "an input file cannot be read",
        "The file does not exist, is a folder, or may not be read; the message says what the system says. Devices are "
        "not read, nor pipes into which nobody writes, nor more than 1 GB as a whole or through a pipe. Or a "
        "long program was changed while it was corrected, so that its parts need not fit together.",
        "Check the path and the permissions.",
    ),
    "NCF003": Code(
        "no output given",
        "Programs are never changed where they are unless you say so, and a folder needs a name to write under.",
        "Say `-o FILE`, `-o FOLDER`, `-o -` for standard output, or `--in-place`, which keeps the original as "
        "FILE.orig.",
    ),
    "NCF004": Code(
        "the output exists already",
        "ncfix does not replace a file that it was not told to replace.",
        "Choose another `-o`, or say `--force`.",
    ),
    "NCF005": Code(
        "an output that must not be written",
        "The output is an input, a symbolic link, or not an ordinary file; or its folder below the output folder is a "
        "symbolic link; or it would be replaced through one. Writing it could destroy what it stands for.",
        "Choose another `-o`; `--in-place` keeps the original; `-o -` is standard output.",
    ),
    "NCF007": Code(
        "the output cannot be written",
        "The disk is full, the folder may not be written, or the like. A file that was there before is as it was; "
        "nothing half written is left.",
        "Make room, or choose another `-o`.",
    ),
    "NCF020": Code(
        "an input given twice",
        "The same file is named twice, perhaps under two names. Measurements that count twice look better.",
        "Leave it out once; a measurement that was repeated is another file, or has a column `repeat`.",
    ),
    "NCF023": Code(
        "a name that an output may not have",
        "Programs are carried to controls, and those run Windows. There `CON.nc` is the console, a full stop or blank "
        "at the end of a name is dropped, and `\\` or `:` in it make a path of it. A name with a control character, or "
        "one that leads out of the output folder, is not written either. This holds on all systems.",
        "Give the program, or the output, another name.",
    ),
    "NCF025": Code(
        "an invalid argument",
        "A function was given a number outside the range that makes sense, a choice that there is not, or nothing "
        "where something is needed. The command line refuses the same values of its options with NCF001.",
        "The hint of the message says what there is; docs/api.md shows the functions at work.",
    ),
    "NCF501": Code(
        "a plugin cannot be imported",
        "Its entry point is there, but loading it failed. It is left out, everything else works.",
        "Reinstall the plugin, uninstall it, or name it in NCFIX_DISABLE_PLUGINS. NCFIX_STRICT_PLUGINS=1 makes it an "
        "error.",
    ),
    "NCF502": Code(
        "a plugin has a hook that ncfix does not know",
        "A function is marked as a hook, but its name or its arguments are none of ncfix's: misspelled, or made for "
        "another version. The whole plugin is left out.",
        "`docs/plugins.md` lists the hooks and their arguments.",
    ),
    "NCF503": Code(
        "two plugins take the same name",
        "A name of a dialect, a basis and so on can be taken once; the plugin that comes later is left out. The "
        "built-in ones come first, then by the name of the distribution.",
        "Uninstall one, or name it in NCFIX_DISABLE_PLUGINS.",
    ),
    "NCF504": Code(
        "a plugin failed while it registered",
        "A hook of the plugin raised an exception. The whole plugin is left out, with what it had registered before.",
        "Tell its author; `ncfix plugins` shows what is in.",
    ),
    "NCF505": Code(
        "a plugin registers something without a name",
        "`register(thing)` files a thing under `thing.name`, which must be a text; others need `register(thing, "
        'name="...")`.',
        "Tell its author.",
    ),
    "NCF506": Code(
        "a plugin without hooks",
        "The module has no function that is marked as a hook, or one with a hook's name that is not marked.",
        "Mark it with `@ncfix.hookspecs.hookimpl`.",
    ),
    "NCF507": Code(
        "a plugin failed",
        "The code of a plugin raised an exception that is no message of its own: a fault of the plugin, not of the "
        "input and not of ncfix. Nothing was written.",
        "Tell its author; `ncfix --debug` shows the traceback. NCFIX_DISABLE_PLUGINS leaves the plugin out.",
    ),
    "NCF508": Code(
        "a plugin brings something of the wrong kind",
        "What it registered cannot be what the hook is for, and is left out; or what it returned is not what it must.",
        "Tell its author; `docs/plugins.md` says what each hook registers and what that returns.",
    ),
    "NCF509": Code(
        "a file of no known form",
        "`ncfix lint` knows tables by what they hold: no control of a plugin, and none of the forms of other controls "
        "that are known, has lines like these; or a damaged line hides which it is.",
        "`--control NAME` says whose tables they are; `ncfix plugins` lists the controls.",
    ),
}
