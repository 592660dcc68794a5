// SPDX-License-Identifier: Apache-2.0
#include <robomosp/sdk/conformance/language_suite.h>

namespace robomosp::conformance {
namespace {

constexpr const char* kStack = R"(PROGRAM stack;
SYSTEM_SPECIFICATION 'cell.ssi';
IMPORT grip FROM tools;
SIGNAL
  INPUT BOOL: part_here AT 1;
  OUTPUT INT: lamp AT 10, 4;
TYPE
  RECORD INT: height; POSITION: foot; ENDRECORD: PLACE;
VAR
  ARRAY [1..2] OF PLACE: places := [PLACE(0, POSITION(500.0, 0.0, 0.0)), PLACE(2, POSITION(500.0, 300.0, 0.0))];
  ORIENTATION: down := ORIZYX(0.0, 180.0, 0.0);
  LIST OF INT: done;
  INT: i;
FUNCTION top (IN INT: k): POSE;
BEGIN
  RETURN POSE(POSITION(places[k].foot.X, places[k].foot.Y, 30.0 * places[k].height), down);
ENDFCT;
PROCEDURE bring (IN INT: n, a, b);
BEGIN
  IF n = 0 THEN RETURN; ENDIF;
  MOVE PTP top(a) SPEED_PTP := 50.0 C_PTP := 10.0;
  grip(TRUE);
  MOVE LIN top(b) SPEED := 100.0 UNTIL part_here;
  grip(FALSE);
  LIST_ADD(done, n);
  bring(n - 1, a, b);
ENDPROC;
PROCESS blink PRIORITY 2;
BEGIN
  LOOP
    lamp := 1; WAIT 0.5 SEC; lamp := 0; WAIT 0.5 SEC;
    IF SIZEOF(done) > 1 THEN EXIT; ENDIF;
  ENDLOOP;
ENDPROCESS;
BEGIN
  START blink;
  WAIT FOR part_here AND NOT R_TIMEOUT TIMEOUT 2.0;
  bring(2, 1, 2);
  FOR i := 3 DOWNTO 1 CASE i OF WHEN 1, 2: WRITELN('one or two'); DEFAULT: HALT; ENDCASE; ENDFOR;
  MOVE CIRCLE POSE(POSITION(1.0, 2.0, 3.0), down), POSE(POSITION(2.0, 2.0, 3.0), down);
  MOVE_INC LIN POSITION(0.0, 0.0, 50.0);
ENDPROGRAM;
)";
constexpr const char* kTools = R"(MODULE tools;
EXPORT grip;
SIGNAL OUTPUT BOOL: gripper AT 3;
PROCEDURE grip (IN BOOL: shut); BEGIN gripper := shut; ENDPROC;
ENDMODULE;
)";
constexpr const char* kCell = R"(PROGRAM cell;
CONST INT: R_NTURNS := 2, R_NADDJ := 1, R_NJ := 5, R_DEVICE_NUMBER := 1;
TYPE
  RECORD REAL: A1, A2, A3, A4; ENDRECORD: MAIN_JOINT;
  RECORD REAL: AA1; ENDRECORD: ADD_JOINT;
  RECORD MAIN_JOINT: M_JOINT; ADD_JOINT: A_JOINT; ENDRECORD: JOINT;
  RECORD POSE: PSE; INT: STATUS; ARRAY [1..R_NTURNS] OF INT: TURNS; ADD_JOINT: A_JOINT; ENDRECORD: ROBTARGET;
ENDPROGRAM;
)";

INSTANTIATE_TEST_SUITE_P(
    Irl, LanguageConformance,
    testing::Values(LanguageCase{
        ROBOMOSP_PLUGIN_DIR "/irl.so",
        "irl",
        {{"stack", {{"stack.irl", kStack}, {"tools.irl", kTools}, {"cell.ssi", kCell}}}}}));

}  // namespace
}  // namespace robomosp::conformance
