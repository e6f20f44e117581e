"""Message codes of interpreting a program (2xx) and of the setup files (38x)."""

from __future__ import annotations

from ncfix.diagnostics import Code

CODES: dict[str, Code] = {
    "NCF201": Code(
        "work offset not given",
        "The program moves in a work offset (G54 ... G59.3) whose values are in the control, and the setup does not "
        "give them. The correction depends on the positions of the machine's axes, so ncfix needs the offset. A "
        "program that moves before it selects a work offset uses the one that is active at start: G54; on SINUMERIK "
        "G500, which is zero unless there is a basic offset.",
        "--offset G54=x,y,z, or work_offsets in the setup file; with --assume-zero ncfix uses zero for what is "
        "missing.",
    ),
    "NCF202": Code(
        "tool length not given",
        "The program uses the length of a tool (as with G43). It is in the control's tool table, and the setup does "
        "not give it.",
        "--tool 12=LENGTH, --tool-table FILE, or tools in the setup file; with --assume-zero ncfix uses zero.",
    ),
    "NCF203": Code(
        "start position not given",
        "The first motions do not name all axes, so their end positions depend on the positions of the axes at the "
        "start of the program.",
        "--initial Z=300, or initial in the setup file; with --assume-zero ncfix uses zero.",
    ),
    "NCF204": Code(
        "reference point not given",
        "The positions that follow depend on a reference point (G28, G30), which is set on the control.",
        "references in the setup file; with --assume-zero ncfix uses zero.",
    ),
    "NCF205": Code(
        "taken as zero",
        "The program uses a value that is not given, and because of --assume-zero ncfix uses zero. The correction is "
        "right only if the value really is zero.",
        "Give its value.",
    ),
    "NCF206": Code(
        "axis that the machine lacks",
        "The program moves an axis that is not in the machine file.",
        "Check that it is the file of the machine that the program was written for.",
    ),
    "NCF207": Code(
        "axis without a letter",
        "An axis of the machine file has a name that is not an axis letter of the program's language.",
        "Name the axis X, Y, Z, A, B, C, U, V or W.",
    ),
    "NCF208": Code(
        "codes exclude one another",
        "The block has two codes of one modal group, such as G0 and G1. Only one of them can be in force.",
        "Remove one of them.",
    ),
    "NCF209": Code(
        "word without use",
        "No code of the block uses this word. LinuxCNC refuses such a block. Often a code is missing or mistyped.",
        "Remove the word, or add the code that uses it.",
    ),
    "NCF210": Code(
        "impossible arithmetic",
        "An expression cannot be calculated (a division by zero, for example), or its value is not allowed at this "
        "place.",
        "Check the expression and the parameters in it.",
    ),
    "NCF211": Code(
        "parameter not defined",
        "The program reads a named parameter before it assigns a value to it.",
        'Assign a value first. For a parameter of the control itself, give its value as variables."#<name>" in the '
        "setup file.",
    ),
    "NCF212": Code(
        "parameter is read-only",
        "The control sets this parameter itself. A program can only read it.",
        "Use another parameter.",
    ),
    "NCF213": Code(
        "no such parameter",
        "The control has no parameter or variable of this number. LinuxCNC has #1 to #5602.",
        "Check the number, or the expression that gives it.",
    ),
    "NCF214": Code(
        "tool length without a Z word",
        "G43 or G49 is in a block without Z. Some controls of the Fanuc family then move the axis by the tool length; "
        "others (parameter TOS) only shift its coordinate. ncfix assumes that the axis does not move. Blocks up to "
        "the next Z word are corrected for that height.",
        "Program Z in the block.",
    ),
    "NCF215": Code(
        "no unit",
        "The program moves without G20 or G21 before (SINUMERIK: G70, G71, G700, G710). The unit is then set on the "
        "control; ncfix assumes millimetres. If the control uses inches, positions are 25.4 times as large, and the "
        "corrections are for other positions.",
        "Program the unit at the beginning of the program.",
    ),
    "NCF216": Code(
        "alarm of the program",
        "The program sets #3000, with which the control stops with an alarm. With the offsets, tools and variables of "
        "the setup the program executes this block.",
        "Give the values that the program checks under `variables` in the setup file.",
    ),
    "NCF217": Code(
        "tool length without a number",
        "G43 is in a block without H, and the program has no H before it. Controls use the last H that was active, "
        "which the program does not show. ncfix uses the length of the tool in the spindle.",
        "Program H in the block of G43.",
    ),
    "NCF218": Code(
        "tool-centre-point control switched on with the axes turned",
        "G43.4 is switched on while a rotary axis is not at zero. A parameter of the control decides whether X Y Z "
        "count in the workpiece as it lies with all rotary axes at zero, or as it lies when G43.4 is switched on. "
        "ncfix assumes the first.",
        "Switch G43.4 on with the rotary axes at zero, or check the parameters (Fanuc: 19696 WKP, 19754 RPS).",
    ),
    "NCF219": Code(
        "tool direction that the machine cannot reach",
        "A tool direction (I J K of G43.5) is a vector of length zero, or the rotary axes cannot turn the tool to it "
        "within their travels. A control stops with an alarm.",
        "Check the vector, and that the machine file belongs to this machine.",
    ),
    "NCF220": Code(
        "impossible arc",
        "The control would refuse the arc: it does not close, has no radius or no centre, cannot reach its end, or "
        "its words contradict one another.",
        "Check end point, centre or radius, the plane, and whether the centre is relative to the start of the arc or "
        "absolute.",
    ),
    "NCF221": Code(
        "impossible command",
        "The control would refuse the block: its codes and words exclude one another, or are not allowed in the modes "
        "in force.",
        "The message says what is missing or not allowed.",
    ),
    "NCF222": Code(
        "impossible G10",
        "G10 sets a work offset (L2, L20) or a tool (L1, L10, L11). Its words do not say which one, or are not "
        "allowed.",
        "Check L and P.",
    ),
    "NCF223": Code(
        "impossible polar coordinate",
        "The control does not accept these polar coordinates. With @ and ^ they replace X and Y in the plane G17 and "
        "need radius and angle at the origin; on SINUMERIK machine coordinates (SUPA, G53) exclude AP and RP.",
        "Program X and Y instead.",
    ),
    "NCF224": Code(
        "impossible tool or length offset",
        "G43.2 needs H or axis words. H and T are whole numbers and not negative. M61 needs Q.",
        "Check the words.",
    ),
    "NCF225": Code(
        "no feed",
        "A motion at feed rate needs F. On LinuxCNC F must be programmed again after G94 or G95, and in every block "
        "in G93. G95 also needs a spindle speed S.",
        "Program F in the block.",
    ),
    "NCF226": Code(
        "impossible canned cycle",
        "A word that the canned cycle needs is missing, or has a value that is not allowed, or a mode in force does "
        "not allow the cycle.",
        "The message says which.",
    ),
    "NCF227": Code(
        "unknown G code",
        "LinuxCNC has no such code.",
        "Correct it. If the machine remaps this code, ncfix cannot know what it does.",
    ),
    "NCF228": Code(
        "unknown code or command, motions refused",
        "ncfix does not know this code or command for this control. It may move axes or change coordinates, so ncfix "
        "refuses the motions after it.",
        "If ncfix has a dialect for the control, select it with --dialect. If a code of the machine builder neither "
        'moves axes nor changes coordinates, list it in the setup file: `passed_codes = ["G131"]`. In a block with '
        "axis words or a length offset (H) it is refused nevertheless.",
    ),
    "NCF229": Code(
        "unknown M code",
        "LinuxCNC has no such code.",
        "Correct it. If the machine remaps this code, ncfix cannot know what it does.",
    ),
    "NCF230": Code(
        "flow control not closed",
        "O-words or control structures (IF, WHILE, FOR, ...) do not match: a beginning or an end is missing, a label "
        "is missing or used twice, or a line is not allowed at this place.",
        "Correct the lines with the label or keyword that the message names.",
    ),
    "NCF231": Code(
        "subprogram not found",
        "The program calls a subprogram that is neither in the program nor in a file of that name in the same folder.",
        "Copy its file to the folder of the program, or give its folder with --subprograms or in the setup file.",
    ),
    "NCF232": Code(
        "subprograms nested too deep",
        "More calls are open at the same time than the control allows. Often a subprogram calls itself without end.",
        "Check the condition that ends the calls.",
    ),
    "NCF233": Code(
        "endless program",
        "The program never ends: it jumps back again and again, and no value changes in between, or only a value that "
        "the machine sets. Or it executes more blocks than most_blocks allows (a million more than the text has). "
        "Repeats of cycles and of subprograms count, too, and are checked before they begin.",
        "Check the condition of the loop. If the program does end, set a larger most_blocks in the setup file.",
    ),
    "NCF234": Code(
        "no program end",
        "The program ends without M2, M30 or a second `%`, or in Klartext without END PGM.",
        "The end may be missing: check that the file was transferred completely.",
    ),
    "NCF235": Code(
        "block skip",
        "The operator's block delete switch decides whether blocks that begin with `/` are executed or skipped. "
        "`fix`, `check` and `verify` keep the tolerance in both positions of the switch, and in all positions of "
        "several switches (`/2`, `/3`). A command that uses one position only says which one.",
        "`--block-skip on` or `off` (block_skip in the setup file), if the switch is always in that position. ncfix "
        "then uses only that position, and the stamp says which.",
    ),
    "NCF236": Code(
        "line cannot be read",
        "The program executes a line that is not in the control's language.",
        "Correct the line.",
    ),
    "NCF237": Code(
        "cannot be written out flat",
        "--flatten writes every block as it is executed. A block that depends on a probe, an input or a position at "
        "run time is not known before.",
        "Make the correction in the CAM system or post-processor, or remove the part that depends on run time.",
    ),
    "NCF238": Code(
        "flat program too long",
        "Written out flat, with all loops and subprogram calls, the program would have more lines than are allowed.",
        "Split the program, or make the correction in the CAM system or post-processor.",
    ),
    "NCF239": Code(
        "no flat form",
        "The program cannot be written out flat: its dialect has no such form, or the flat program would not make the "
        "same motions.",
        "Leave --flatten out; blocks that are executed from several states are then refused.",
    ),
    "NCF240": Code(
        "number without a decimal point",
        "On controls of the Fanuc family a parameter decides whether X50 is 50 mm or 0.050 mm. The program does not "
        "show it. With the wrong meaning all positions are wrong by a factor of 1000.",
        "--no-point IS-B (least increments, the control's own default) or --no-point calculator, or no_point in the "
        "setup file.",
    ),
    "NCF241": Code(
        "program reads a position",
        "The program reads the position of an axis. In the corrected program this is the corrected position, so "
        "values that the program calculates from it change.",
        "Motions that depend on it are refused. Write the position as a number, or keep it in a variable of its own.",
    ),
    "NCF242": Code(
        "jump or call not possible",
        "The target of a jump, loop or return is not in the program (an N word, an END or an M99 is missing), or "
        "controls execute this form of a subprogram call in different ways.",
        "Correct the block that the message names.",
    ),
    "NCF243": Code(
        "several ways to turn the tool",
        "G53.1 turns the rotary axes until the tool is normal to the plane; I J K of G43.5 until it points along the "
        "vector. Here more than one position of the rotary axes does that. Which one the control uses depends on its "
        "parameters and on the travels. ncfix assumes the nearest.",
        "If the control uses other positions, program the rotary axes themselves.",
    ),
    "NCF244": Code(
        "variable that the program has not set",
        "Common variables (#100 ... #199, #500 ...) keep the values that another program or the operator has set, and "
        "the caller sets those of a macro. Their values are known only at run time.",
        'Give the value in the setup file (`variables."#500" = 5.0`), or correct the program that calls the macro, '
        "with --flatten.",
    ),
    "NCF245": Code(
        "a parameter decides on which axes a code acts",
        "G51 with one factor scales the axes that a parameter selects, usually X, Y and Z. In G18 and G19 one "
        "parameter decides whether drilling cycles drill along Z or along the axis normal to the plane, and another "
        "one along which axis the tool length offset acts. The program does not show these parameters.",
        "Check the parameter (Fanuc: 5401 SCL, 5101 FXY, 5001 TLB).",
    ),
    "NCF246": Code(
        "program in the control, not found",
        "The program calls one of O8000 to O9999 (of the probe's or the machine's builder). It is in the control, and "
        "ncfix does not have its text. ncfix assumes that it does not change offsets, tool lengths or modal codes. "
        "After the call, positions, motion code and feed rate are not known until the program gives them.",
        "Copy its file to the folder of the program. If it sets a work offset or a tool length, give the values that "
        "it sets.",
    ),
    "NCF247": Code(
        "a rotary axis may turn in the other direction",
        "A word turns a rotary axis by half a turn or more, or turns it back after increments or directions have "
        "moved it beyond 360 degrees or below zero. The program does not show whether the control turns as written, "
        "in the shorter direction (roll-over, Fanuc parameter 1008; SINUMERIK MD30455), or from an angle between 0 "
        "and 360 degrees. ncfix corrects the end and does not split the motion: with pieces the axis could turn in "
        "another direction than with the original block.",
        "If the axis must turn in the longer direction, write the turn in two blocks; on SINUMERIK use ACP, ACN or DC.",
    ),
    "NCF248": Code(
        "position out of all bounds",
        "A position is beyond 1e9 mm or 1e9 radians, or an arc has its centre there. A number probably has too many "
        "digits; a control stops at such a block.",
        "Check the numbers of the block, and the increments, shifts and scale factors before it.",
    ),
    "NCF249": Code(
        "blocks that are never executed",
        "The file has blocks with axis words that the program never executes: it ends before them (M30, M2, %, END "
        "PGM), or jumps over them. They may be another program in the same file, a subprogram that is never called, a "
        "branch that is not taken with these values, or remains of editing. ncfix corrects the blocks that the first "
        "program executes, and the subprograms that it calls. If none of its blocks is corrected (for example because "
        "a text before the first % is read as the program), ncfix refuses it.",
        "Put each program in a file of its own and correct it there; delete what is not needed. If a value in the "
        "program selects a branch, change the value in the original and correct the original again.",
    ),
    "NCF258": Code(
        "a subprogram",
        "The text ends with M99, M17, RET or endsub and has no M2 or M30, so other programs call it. Its offsets, "
        "tool and positions are those of the caller, and one text cannot be right for several calls. In a folder "
        "ncfix leaves it out. If you name the file itself, ncfix corrects it as a program that starts in the state of "
        "the setup.",
        "Correct the programs that call it with `--flatten`, which writes the subprogram out in them. If it is a main "
        "program that only repeats at its end, name the file itself.",
    ),
    "NCF280": Code(
        "a cycle that is shifted as a whole",
        "The control mills a pocket, a stud, a face or a thread around the position of the call. ncfix corrects this "
        "position and the bottom. The errors differ over the milled area; this difference is not corrected, and the "
        "figures do not include it. For a contour that a cycle mills (CYCLE72), ncfix corrects each point, and the "
        "depth at the start of the contour.",
        "If the whole shape must be exact, program it with single blocks instead of the cycle.",
    ),
    "NCF381": Code(
        "the setup file is not TOML",
        "The file cannot be read as TOML; the message says where.",
        "docs/formats.md shows a setup file.",
    ),
    "NCF382": Code(
        "unknown key in the setup file",
        "ncfix does not know this key. It never ignores a key without a message.",
        "Check its spelling.",
    ),
    "NCF383": Code(
        "wrong value in the setup file",
        "A value does not have the type that its key needs.",
        "docs/formats.md shows a setup file.",
    ),
    "NCF384": Code(
        "work offset without axis names",
        "A list of numbers gives X Y Z A B C U V W in this order, so the fifth number is B, also on a machine with A "
        "and C. Decimal commas are not possible: 1,5,2,5,3,5 are six numbers.",
        "Name the axes: G54 = { Z = 60, C = 10 }, or --offset G54=Z60,C10.",
    ),
    "NCF385": Code(
        "wrong line in a tool table",
        "A line of the tool table cannot be read, or a tool appears twice.",
        "LinuxCNC: `T1 P1 Z120.5 D10`; CSV: a header `tool,length,radius`; SINUMERIK: `$TC_DP3[1,1]=120.5`; Fanuc: "
        "`G10 L10 P1 R120.5`.",
    ),
    "NCF386": Code(
        "tool table possibly in inches",
        "The longest tool of the table is too short for a tool with its holder in mm. ncfix reads tables in mm. Most "
        "tables use the unit of their machine and do not name it.",
        "Give the unit with `--tool-unit inch` or `--tool-unit mm`.",
    ),
}
