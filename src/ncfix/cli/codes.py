"""Message codes of the command line."""

from __future__ import annotations

from ncfix.diagnostics import Code

CODES = {
    "NCF000": Code(
        "a fault of ncfix",
        "Something happened that ncfix did not foresee. It is not your input's fault, whatever that was.",
        "Run it again with `ncfix --debug ...` (or NCFIX_DEBUG=1) and report the traceback with the input.",
    ),
    "NCF001": Code(
        "wrong use of the command line",
        "A verb or an option that does not exist, a value that is missing or of the wrong kind.",
        "`ncfix --help` and `ncfix VERB --help` show what there is.",
    ),
    "NCF006": Code(
        "two outputs of the same name",
        "Files of the same name from different folders would overwrite each other in one output folder. So would files "
        "whose names differ only in large and small letters, on a computer that does not tell them apart.",
        "Write them into different folders.",
    ),
    "NCF008": Code(
        "fixed in place before",
        "FILE.orig exists, so FILE seems to be a result already; going on would lose the original.",
        "Rename FILE.orig back to FILE to fix the original again, or remove it.",
    ),
    "NCF009": Code(
        "no such message code",
        "`ncfix explain` was asked for a code that no message has.",
        "`ncfix explain` without a code lists them all.",
    ),
    "NCF010": Code(
        "two data streams for one output",
        "Two outputs, a program and the JSON object, say, would both go to standard output.",
        "Write one of them to a file: `-o FILE`.",
    ),
    "NCF011": Code(
        "two places for one output",
        "`--in-place` puts the result where the program is, `-o` somewhere else.",
        "Leave one of them out.",
    ),
    "NCF012": Code("interrupted", "The command was stopped with Ctrl-C. Outputs that were not complete are not there."),
    "NCF013": Code(
        "an output in a pipe that would have to change",
        "A long program that goes to a pipe is written while it is read. Further down something was found that changes "
        "what comes before it: a refusal that reaches far back, or frames that are set where the machine stands.",
        "Give the program as a file; then it is looked at as a whole before anything is written.",
    ),
    "NCF014": Code(
        "no program in a folder",
        "Of a folder, the files with a suffix of a dialect are taken, below it too; hidden files, symbolic links, "
        "pipes, devices and `.orig` files are not.",
        "`ncfix dialects` lists the suffixes; files with another one can be named.",
    ),
    "NCF015": Code(
        "no such executor",
        "`--executor` says what runs the programs of a batch: processes of this computer, or what a plugin reaches.",
        "`ncfix plugins` lists what plugins bring.",
    ),
    "NCF016": Code(
        "nothing to go on with",
        "`--resume` goes on with the outputs in a folder where an earlier run stopped.",
        "Say `-o FOLDER`, the same as then.",
    ),
    "NCF017": Code(
        "a process was killed",
        "With `--jobs`, a program was given to a process of its own, which was killed from outside (mostly because "
        "memory ran out), and so was the one that tried again; or one of those that worked on it together was. The "
        "other programs are not concerned.",
        "Fix the program alone, with `--jobs 1`, on a computer with more memory.",
    ),
    "NCF018": Code(
        "a report of another form",
        "The suffix of the file says what form a report has. There are HTML and Markdown, and what plugins bring.",
        "Write it to FILE.html or FILE.md.",
    ),
    "NCF019": Code(
        "not a result",
        "A report is made of machine files (TOML) and of what verbs print with `--json`: one object with a `schema`.",
        "Keep what the verb prints: `ncfix fix ... --json > result.json`.",
    ),
    "NCF022": Code(
        "standard input for two inputs",
        "`-` stands for standard input, and what has been read from it is gone.",
        "Give one of the inputs as a file.",
    ),
    "NCF024": Code(
        "not enough memory",
        "The system gave ncfix no more memory. Long programs are corrected in parts, in bounded memory, as far as they "
        "can be; what has to be looked at as a whole takes many times the memory of its text.",
        "Do it on a computer with more memory, or in smaller pieces; `--jobs 1` takes the least.",
    ),
    "NCF026": Code(
        "two batches for one folder",
        "While a batch runs, its journal (`.ncfix-journal.jsonl` in the folder of the outputs) is locked, so that two "
        "do not write the same files.",
        "Wait until the other one is done, or give another `-o`.",
    ),
    "NCF027": Code(
        "an output of an earlier state",
        "A program was corrected, then it was changed, or the machine, the set-up or the options were; and now it "
        "fails or is refused. The output in the folder is the correction of the earlier state. ncfix removes no "
        "output.",
        "Do not use this output: remove it, or put right what the program fails of.",
    ),
    "NCF028": Code(
        "a fault in a project file",
        "`ncfix.toml` says what holds for the programs of a folder: `machine`, `setup`, `output`, `dialect`, "
        "`tool_table`, a table `[options]` of options of `ncfix fix`, and `[[programs]]` with a `match`. "
        "Something else stands there, or another kind of value. `force`, `in_place` and `executor` are said on the "
        "command line only: a project file may come with programs from anywhere.",
        "docs/formats.md has the keys; `--no-project` goes without the file.",
    ),
    "NCF029": Code(
        "a cluster that cannot be used",
        "`--executor dask://HOST:PORT` gives the programs of a batch to a Dask cluster. Its scheduler does not answer "
        "or is gone, or it has no workers, or these have another version of ncfix. What is done is in the journal.",
        "Start scheduler and workers, with the same ncfix and the same folders; then the same command with `--resume`.",
    ),
    "NCF030": Code(
        "a program took too long",
        "`--time-limit-s` says how many seconds a program of a batch may take. Nothing was written for it; the other "
        "programs are not concerned. It is not tried again by `--resume` until something changes.",
        "Give it more time, or fix it alone; `--retry` tries again.",
    ),
    "NCF031": Code(
        "a library that draws is not installed",
        "The page of a program is drawn by plotly's library for browsers, a picture for papers by matplotlib. Both are "
        "extras, which ncfix does not need for anything else.",
        'pip install "ncfix[report]" for pages, "ncfix[plot]" for pictures.',
    ),
    "NCF032": Code(
        "a certificate that does not hold",
        "The program, the corrected program, the machine file or the setup is another one than the certificate is "
        "about, or the second reader finds something else in them now.",
        "Correct the program again, and write a new certificate.",
    ),
    "NCF033": Code(
        "a corrected program in which the second reader finds faults",
        "A second reader, which shares no parsing code with `fix`, has followed the corrected program. It is not what "
        "the correction of the original should be. The program was written all the same.",
        "Do not run it. `ncfix verify ORIGINAL FIXED -m MACHINE --certificate FILE` lists the faults; report them.",
    ),
    "NCF034": Code(
        "a file that is no certificate",
        "`--against` names a certificate that `ncfix verify --certificate` or `ncfix fix --certificate` has written.",
        "Give that file; write it anew if it was made by another version of ncfix.",
    ),
}
