"""Message codes of interpreting a program (2xx) and of the setup files (38x)."""

from __future__ import annotations

from ncfix.diagnostics import Code

CODES: dict[str, Code] = {
    "NCF201": Code(
        "work offset not given",
        "The program moves in a coordinate system (G54 ... G59.3) whose offset is set on the control. A correction "
        "depends on where the axes stand, so it has to be known. A program that moves before it calls one is in that "
        "of the control's start: G54, on SINUMERIK G500, which is zero unless there is a basic offset.",
        "--offset G54=x,y,z, or work_offsets in the setup file; --assume-zero takes what is missing as zero.",
    ),
    "NCF202": Code(
        "tool length not given",
        "A tool length offset (G43) takes a length from the control's tool table, and it is not given.",
        "--tool 12=LENGTH, --tool-table FILE, or tools in the setup file; --assume-zero takes it as zero.",
    ),
    "NCF203": Code(
        "start position not given",
        "The first motions do not name all axes, so that where they lead depends on where the axes stand at the start.",
        "--initial Z=300, or initial in the setup file; --assume-zero takes it as zero.",
    ),
    "NCF204": Code(
        "reference point not given",
        "The program computes with the position of a reference point (G28, G30), which is set on the control.",
        "references in the setup file; --assume-zero takes it as zero.",
    ),
    "NCF205": Code(
        "taken as zero",
        "Something that the program uses was not given, and --assume-zero says that it is zero. The correction is "
        "right only if it really is.",
        "Give its value.",
    ),
    "NCF206": Code(
        "axis that the machine lacks",
        "The program has a word for an axis that is not in the machine file.",
        "Check that it is the file of the machine that the program was written for.",
    ),
    "NCF207": Code(
        "axis without a letter",
        "An axis of the machine file has a name that no word of the language can move.",
        "Axes are called X Y Z A B C U V W.",
    ),
    "NCF208": Code(
        "codes exclude one another",
        "Two codes of one modal group stand in the block, as G0 and G1: only one of them can be in force.",
        "Take one of them out.",
    ),
    "NCF209": Code(
        "word without use",
        "No code of the block uses this word. LinuxCNC refuses such a block: often a code is missing or mistyped.",
        "Take the word out, or put its code in.",
    ),
    "NCF210": Code(
        "impossible arithmetic",
        "An expression cannot be computed, as a division by zero, or its value cannot be used where it stands.",
        "Check the expression and the parameters in it.",
    ),
    "NCF211": Code(
        "parameter not defined",
        "A named parameter is read before anything was assigned to it.",
        'Assign to it first; what the control has of its own goes into variables."#<name>" of the setup file.',
    ),
    "NCF212": Code(
        "parameter is read-only",
        "The control keeps this parameter itself; a program can only read it.",
        "Assign to another parameter.",
    ),
    "NCF213": Code(
        "no such parameter",
        "Numbered parameters are #1 to #5602.",
        "Check the number, or the expression that computes it.",
    ),
    "NCF214": Code(
        "tool length without a Z word",
        "G43 or G49 stands in a block without Z. Some controls of the Fanuc family move the axis by the length then, "
        "others (parameter TOS) only shift its coordinate, as ncfix takes it. Blocks up to the next Z word are "
        "corrected for that height.",
        "State Z in the block.",
    ),
    "NCF215": Code(
        "no unit",
        "The program moves and has said neither G20 nor G21 (SINUMERIK: G70, G71, G700, G710). What holds then is set "
        "on the control; ncfix takes millimetres. If it is inches, positions are 25.4 times as large, and the "
        "corrections are for another place.",
        "Put such a code at the beginning of the program.",
    ),
    "NCF216": Code(
        "alarm of the program",
        "The program sets #3000: the control stops with an alarm. It gets there with the offsets, tools and variables "
        "that are given here.",
        "Give the variables that the program checks, as variables in the setup file.",
    ),
    "NCF217": Code(
        "tool length without a number",
        "G43 stands in a block without H, and the program has named no H before. Controls take the H that was last in "
        "force, which cannot be seen in the program; ncfix takes the tool in the spindle.",
        "State H in the block of G43.",
    ),
    "NCF218": Code(
        "tool-centre-point control switched on with the axes turned",
        "G43.4 is switched on while a rotary axis is not at zero. Whether X Y Z then ride on the workpiece as it lies "
        "with all rotary axes at zero, or as it lies at that moment, is set on the control; ncfix takes the first.",
        "Switch G43.4 on with the rotary axes at zero, or make sure of the parameters (19696 WKP, 19754 RPS).",
    ),
    "NCF219": Code(
        "direction of the tool that the machine cannot take",
        "A direction of the tool (I J K of G43.5) has no length, or is one in which the rotary axes cannot point the "
        "tool within their travels. A control raises an alarm.",
        "Check the vector, and that the machine file is the right one.",
    ),
    "NCF220": Code(
        "impossible arc",
        "The control would refuse the arc: it does not close, has no radius or no centre, or cannot reach its end.",
        "Check end point, centre or radius, the plane, and whether centres count from the start of the arc.",
    ),
    "NCF221": Code(
        "impossible command",
        "The control would refuse the block: its codes and words do not go together, or not with what is in force.",
        "The message says what is missing or in the way.",
    ),
    "NCF222": Code(
        "impossible G10",
        "G10 sets a coordinate system (L2, L20) or a tool (L1, L10, L11); its words do not say which, or how.",
        "Check L and P.",
    ),
    "NCF223": Code(
        "impossible polar coordinate",
        "Polar coordinates (@ and ^) give X and Y in the plane G17, and need both radius and angle at the origin.",
        "Give X and Y instead.",
    ),
    "NCF224": Code(
        "impossible tool or length offset",
        "G43.2 needs H or axis words, H and T whole numbers that are not negative, and M61 its Q.",
        "Check the words.",
    ),
    "NCF225": Code(
        "no feed",
        "A motion at feed needs F; after G94 and G95 it has to be given anew, in G93 in every block.",
        "Put F into the block.",
    ),
    "NCF226": Code(
        "impossible canned cycle",
        "A canned cycle lacks a word that it cannot begin with, or has one that it cannot use.",
        "The message says which.",
    ),
    "NCF227": Code(
        "unknown G code",
        "LinuxCNC has no such code.",
        "Correct it. If it is remapped on the machine, ncfix cannot know what it does.",
    ),
    "NCF228": Code(
        "unknown code or command, motions refused",
        "The code or command is not one that ncfix knows for this control. It may move axes or change coordinates, so "
        "nothing after it is corrected.",
        "Name the dialect with --dialect, if there is one for the control. Of a code of the machine's builder that "
        'neither moves nor changes coordinates, the setup file can say so: `passed_codes = ["G131"]`; in a block with '
        "words of axes or of a length (H) it is refused all the same.",
    ),
    "NCF229": Code(
        "unknown M code",
        "LinuxCNC has no such code.",
        "Correct it. If it is remapped on the machine, ncfix cannot know what it does.",
    ),
    "NCF230": Code(
        "flow control broken",
        "O-words do not fit together: an end is missing, a label is used twice, or a line stands where it cannot.",
        "The message names the label.",
    ),
    "NCF231": Code(
        "subprogram not found",
        "A subprogram is called that is neither in the program nor in a file of its name beside it.",
        "Put its file beside the program, or name its folder with --subprograms, or in the setup file.",
    ),
    "NCF232": Code(
        "subprograms nested too deep",
        "A control keeps only so many calls at a time; often a subprogram calls itself without end.",
        "Check where the recursion ends.",
    ),
    "NCF233": Code(
        "endless program",
        "The program jumps back where it did before, and nothing has changed in between, or would as long as the "
        "machine changes nothing; or it executes more blocks than most_blocks allows (a million beyond those of the "
        "text): repeats of cycles and of subprograms count, too, and are told before they are begun.",
        "Check the condition of the loop; most_blocks in the setup file allows more.",
    ),
    "NCF234": Code(
        "no program end",
        "The program does not end with M2 or M30, nor between two `%`.",
        "It may be cut off; check that it was transferred completely.",
    ),
    "NCF235": Code(
        "block skip",
        "Blocks that begin with `/` are executed or passed over as the operator chooses; what follows depends on it. "
        "`fix`, `check` and `verify` hold both positions of the switch to the tolerance, or all positions of several "
        "(`/2`, `/3`); what looks at one position says which.",
        "`--block-skip on` or `off` (block_skip in the setup file), if the switch always stands so: then only that "
        "position is looked at, and the stamp says it.",
    ),
    "NCF236": Code(
        "line cannot be read",
        "The control gets to a line that is not written in its language.",
        "Correct the line.",
    ),
    "NCF237": Code(
        "cannot be written out flat",
        "--flatten writes down every block as it is executed. What depends on a probe, an input or a position at run "
        "time is not known before.",
        "Correct the program where it is made, or take the decision out of it.",
    ),
    "NCF238": Code(
        "flat program too long",
        "Written out flat, with its loops and subprograms, the program would have more lines than are allowed.",
        "Correct it where it is made, or split it.",
    ),
    "NCF239": Code(
        "no flat form",
        "The program cannot be written out flat: its dialect has no such form, or the flat program would not make the "
        "same motions.",
        "Leave --flatten out; blocks that are executed from several states are then refused.",
    ),
    "NCF240": Code(
        "number without a decimal point",
        "To controls of the Fanuc family X50 is 50 mm or 0.050 mm, as a parameter of theirs says; the program does "
        "not. Corrected for the wrong one, it would move a thousand times too far or not at all.",
        "--no-point IS-B (least increments, the control's own default) or --no-point calculator, or no_point in the "
        "setup file.",
    ),
    "NCF241": Code(
        "program reads a position",
        "The program reads where the machine stands. When it is corrected it finds the corrected position there, so "
        "what is computed from it would be another value than here.",
        "Motions that depend on it are refused; write the position as a number, or keep it in a variable of its own.",
    ),
    "NCF242": Code(
        "jump to nowhere",
        "GOTO, M99 or a loop refers to a block that is not in the program: an N word, an END or an M99 is missing.",
        "The message names it.",
    ),
    "NCF243": Code(
        "several ways to turn the tool",
        "G53.1 turns the rotary axes until the tool stands square to a plane, I J K of G43.5 until it points along a "
        "vector, and there is more than one way. Which one a control takes depends on its parameters and on its "
        "travels; here it is the nearest.",
        "State the rotary axes in the program if they are others.",
    ),
    "NCF244": Code(
        "variable that the program has not set",
        "Common variables (#100 ... #199, #500 ...) keep what another program or the operator has put there, and those "
        "of a macro are set by its caller: what stands in them is known only at run time.",
        'Give the value in the setup file (`variables."#500" = 5.0`), or correct the program that calls the macro.',
    ),
    "NCF245": Code(
        "a parameter of the control says on which axes a code acts",
        "G51 with one factor magnifies the axes that a parameter names, usually X, Y and Z. In G18 and G19 a parameter "
        "says whether drilling cycles go along Z or across the plane, and another one along which axis a tool length "
        "acts. The program does not show it.",
        "Check the parameter (Fanuc: 5401 SCL, 5101 FXY, 5001 TLB).",
    ),
    "NCF246": Code(
        "program of the control that is not at hand",
        "The program calls one of O8000 to O9999 (of a probe's maker, or of the machine's builder), which is in the "
        "control. It is taken to leave offsets, tool lengths and modal codes as they are. Where the axes stand after "
        "it, the motion code and the feed are not known until the program names them.",
        "Put its file beside the program. If it sets a work offset or a tool length, give those that it finds.",
    ),
    "NCF247": Code(
        "a rotary axis may go the other way round",
        "A word turns a rotary axis by half a turn or more, or back from where increments or directions have led it "
        "beyond a full turn or below zero. Whether a control goes there as written, the shorter way round (roll-over, "
        "Fanuc parameter 1008; SINUMERIK MD30455), or from an angle between 0 and 360 degrees, cannot be seen in the "
        "program. The end is corrected, and the motion is not split: pieces could lead the axis round against what the "
        "program did.",
        "Write such a turn in two blocks, if it is meant to go the longer way; on SINUMERIK with ACP, ACN or DC.",
    ),
    "NCF248": Code(
        "farther away than any machine goes",
        "A motion leads more than 1e9 mm away, or turns an axis by as many radians, or turns about a point there: its "
        "numbers have too many digits. A control stops at them.",
        "Check the numbers of the block, and the increments, shifts and scales before it.",
    ),
    "NCF249": Code(
        "blocks that the program never goes through",
        "The file has blocks that name axes, and the program never goes through them: it ends before (M30, M2, %, END "
        "PGM), or jumps over them. They are another program in the same file, a subprogram that nothing calls, a "
        "branch that is not taken with these values, or what an editor has left there. What is corrected is the first "
        "program, where it goes, and what it calls. If nothing of that is corrected, as where a text before the first "
        "% is taken for the program, it is refused.",
        "Correct each program in a file of its own; delete what is left over. Where a value in the program chooses a "
        "branch, correct the original anew after the value has been changed.",
    ),
    "NCF258": Code(
        "a subprogram",
        "The text ends with M99, M17, RET or endsub and has no M2 or M30: other programs call it. Offsets, tool and "
        "positions are theirs when they do, and no one text is right for several calls. In a folder it is left out. "
        "Named by itself it is corrected as a program that begins in the state of the setup.",
        "Correct the programs that call it with `--flatten`: it is written out in them. If it is a program of its own, "
        "which only begins anew at its end, name the file itself.",
    ),
    "NCF280": Code(
        "a cycle that is moved as a whole",
        "The control makes a pocket, a stud, a face or a thread about the place of the call. That place and the bottom "
        "are corrected; by how much the errors differ across what is milled stays, and is not in the figures. Of a "
        "contour that a cycle mills (CYCLE72), each point is corrected; the depth is that of where it begins.",
        "Mill what has to be exact all round by blocks of its own.",
    ),
    "NCF381": Code(
        "the setup file is no TOML",
        "The file cannot be read as TOML; the message says where.",
        "docs/formats.md shows a setup file.",
    ),
    "NCF382": Code(
        "unknown key in the setup file",
        "A key is not one that ncfix knows; nothing is passed over in silence.",
        "Check its spelling.",
    ),
    "NCF383": Code(
        "wrong value in the setup file",
        "A value is not of the kind that its key needs.",
        "docs/formats.md shows a setup file.",
    ),
    "NCF384": Code(
        "work offset in the order of the machine's axes",
        "A list of numbers gives X Y Z A B C in this order, so the fifth is B, also on a machine with A and C. Numbers "
        "have decimal points: 1,5,2,5,3,5 are six.",
        "Name the axes: G54 = { Z = 60, C = 10 }, or --offset G54=Z60,C10.",
    ),
    "NCF385": Code(
        "wrong line in a tool table",
        "A line of the tool table cannot be understood, or a tool stands twice.",
        "LinuxCNC: `T1 P1 Z120.5 D10`; CSV: a header `tool,length,radius`; SINUMERIK: `$TC_DP3[1,1]=120.5`; Fanuc: "
        "`G10 L10 P1 R120.5`.",
    ),
    "NCF386": Code(
        "tool table that may be in inches",
        "No tool of the table is as long as tools with their holders are in mm. Tables are read in mm; most have the "
        "unit of their machine, and do not say which.",
        "`--tool-unit inch` or `--tool-unit mm`.",
    ),
}
