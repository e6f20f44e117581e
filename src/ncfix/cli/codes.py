"""Message codes of the command line."""

from __future__ import annotations

from ncfix.diagnostics import Code

CODES = {
    "NCF000": Code(
        "an internal fault of ncfix",
        "ncfix failed at something that its authors did not foresee. The fault is in ncfix, not in the input.",
        "Run the command again with `ncfix --debug ...` (or NCFIX_DEBUG=1), and report the traceback with the input.",
    ),
    "NCF001": Code(
        "wrong use of the command line",
        "A verb or an option does not exist, or a value is missing or of the wrong kind.",
        "`ncfix --help` lists the verbs, `ncfix VERB --help` the options.",
    ),
    "NCF006": Code(
        "two outputs of the same name",
        "Files of the same name from different folders would overwrite each other in one output folder. So would "
        "files whose names differ only in upper and lower case, on a computer that ignores the case.",
        "Write them to different folders.",
    ),
    "NCF008": Code(
        "fixed in place before",
        "FILE.orig exists, so FILE seems to be a result already. Correcting it in place again would lose the original.",
        "Rename FILE.orig back to FILE to fix the original again, or remove it.",
    ),
    "NCF009": Code(
        "no such message code",
        "`ncfix explain` was asked for a code that no message has.",
        "`ncfix explain` without a code lists them all.",
    ),
    "NCF010": Code(
        "two data streams for one output",
        "Two outputs, for example a program and the JSON object, would both go to standard output.",
        "Write one of them to a file: `-o FILE`.",
    ),
    "NCF011": Code(
        "two destinations for one output",
        "`--in-place` replaces the program by the result; `-o` writes the result to another path.",
        "Use one of the two options.",
    ),
    "NCF012": Code(
        "interrupted", "The command was stopped with Ctrl-C. Outputs that were not complete were not written."
    ),
    "NCF013": Code(
        "an output that is already in a pipe would have to change",
        "A long program that is written to a pipe is written while it is read. Then a later block required a change "
        "of blocks that were already written, for example because motions before it are refused.",
        "Give the program as a file. Then ncfix reads all of it before it writes.",
    ),
    "NCF014": Code(
        "no program in a folder",
        "In a folder and the folders below it, ncfix takes the files whose suffix belongs to a dialect. It skips "
        "hidden files, symbolic links, pipes, devices and `.orig` files.",
        "`ncfix dialects` lists the suffixes. Files with another suffix can be named one by one.",
    ),
    "NCF015": Code(
        "no such executor",
        "`--executor` names what runs the programs of a batch: processes of this computer, a Dask cluster, or an "
        "executor of a plugin.",
        "`ncfix plugins` lists the executors.",
    ),
    "NCF016": Code(
        "--resume without an output folder",
        "`--resume` continues an earlier run, whose outputs are in a folder.",
        "Give `-o FOLDER`, the folder of the earlier run.",
    ),
    "NCF017": Code(
        "a process was killed",
        "With `--jobs`, a process that corrected this program was killed from outside, most often because memory ran "
        "out, and so was the process of the second attempt. Or one of several processes that corrected it together "
        "was killed. The other programs are not affected.",
        "Fix this program alone, with `--jobs 1`, on a computer with more memory.",
    ),
    "NCF018": Code(
        "a report in an unknown format",
        "The suffix of the file decides the format of a report: HTML, Markdown, or one that a plugin adds.",
        "Write to FILE.html or FILE.md.",
    ),
    "NCF019": Code(
        "a file that is not a result",
        "A report is made from machine files (TOML) and from the output of verbs with `--json`: one object with a "
        "`schema`.",
        "Save the output of the verb: `ncfix fix ... --json > result.json`.",
    ),
    "NCF022": Code(
        "standard input for two inputs",
        "`-` means standard input, which can be read only once.",
        "Give one of the inputs as a file.",
    ),
    "NCF024": Code(
        "not enough memory",
        "The system gave ncfix no more memory. Most long programs are corrected in parts, in bounded memory. A "
        "program that must be corrected as a whole needs many times the memory of its text.",
        "Use a computer with more memory, or divide the work; `--jobs 1` needs the least memory.",
    ),
    "NCF026": Code(
        "two batches in one folder",
        "While a batch runs, its journal (`.ncfix-journal.jsonl` in the folder of the outputs) is locked, so that two "
        "do not write the same files.",
        "Wait until the other batch has ended, or give another `-o`.",
    ),
    "NCF027": Code(
        "an output that is out of date",
        "This output was written before the program, the machine file, the setup or the options were changed. With "
        "the changes, the correction fails or is refused. ncfix removes no output, so the old one is still in the "
        "folder.",
        "Do not run this output. Remove it, or repair what makes the correction fail.",
    ),
    "NCF028": Code(
        "a fault in a project file",
        "`ncfix.toml` has settings for the programs of a folder: `machine`, `setup`, `output`, `dialect`, "
        "`tool_table`, a table `[options]` with options of `ncfix fix`, and tables `[[programs]]` with a `match`. "
        "Another key, or a value of another type, is a fault. `force`, `in_place` and `executor` can be given on the "
        "command line only, because a project file may arrive together with foreign programs.",
        "docs/formats.md lists the keys; `--no-project` ignores the file.",
    ),
    "NCF029": Code(
        "a cluster that cannot be used",
        "`--executor dask://HOST:PORT` runs the programs of a batch on a Dask cluster. Its scheduler does not "
        "answer, it has no workers, or the workers have another version of ncfix. The journal keeps what is done.",
        "Start the scheduler and workers with the same version of ncfix and the same folders. Then repeat the "
        "command with `--resume`.",
    ),
    "NCF030": Code(
        "a program took too long",
        "`--time-limit-s` limits the seconds for one program of a batch. Nothing was written for this program; the "
        "others are not affected. `--resume` does not repeat it until something changes.",
        "Raise `--time-limit-s`, or fix the program alone. `--retry` repeats it.",
    ),
    "NCF031": Code(
        "a library for pages or pictures is not installed",
        "The page of a program needs plotly, a picture needs matplotlib. ncfix uses them for nothing else, so they "
        "are extras.",
        'pip install "ncfix[report]" for pages, "ncfix[plot]" for pictures.',
    ),
    "NCF032": Code(
        "a certificate that is no longer valid",
        "The certificate is about another program, corrected program, machine file or setup than these, or the "
        "second reader now finds something else in them.",
        "Correct the program again, and write a new certificate.",
    ),
    "NCF033": Code(
        "a corrected program in which the second reader finds faults",
        "A second reader, which shares no parsing code with `fix`, has followed the corrected program. Its motions "
        "are not those of a correct correction. The program has been written.",
        "Do not run it. `ncfix verify ORIGINAL FIXED -m MACHINE --certificate FILE` lists the faults; report them.",
    ),
    "NCF034": Code(
        "a file that is no certificate",
        "`--against` needs a certificate that `ncfix verify --certificate` or `ncfix fix --certificate` has written.",
        "Give a certificate. If it was written by another version of ncfix, write it again.",
    ),
}
