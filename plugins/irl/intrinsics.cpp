// SPDX-License-Identifier: Apache-2.0
#include "intrinsics.h"

#include <array>

#include <robomosp/sdk/program_numbers.h>

namespace robomosp::irl {
namespace {

constexpr std::array<Intrinsic, 72> kAll{{
    {"SIN", "r", "r", "Sine of an angle in degrees."},
    {"COS", "r", "r", "Cosine of an angle in degrees."},
    {"TAN", "r", "r", "Tangent of an angle in degrees; an error at odd multiples of 90."},
    {"ASIN", "r", "r", "Angle from -90 to 90 degrees with this sine."},
    {"ACOS", "r", "r", "Angle from 0 to 180 degrees with this cosine."},
    {"ATAN", "r", "r", "Angle from -90 to 90 degrees with this tangent."},
    {"ATAN2", "rr", "r", "Angle from -180 to 180 degrees of the point (x, y), given y, x."},
    {"SQRT", "r", "r", "Square root of a number that is not negative."},
    {"EXP", "r", "r", "Power of e."},
    {"LN", "r", "r", "Natural logarithm of a positive number."},
    {"ABS", "n", "n", "Absolute value."},
    {"TRUNC", "r", "i", "Nearest whole number towards zero."},
    {"ROUND", "r", "i", "Nearest whole number; halves go away from zero."},
    {"FLOAT", "i", "r", "The same number as REAL."},
    {"CHR", "i", "c", "Character with a code from 0 to 255."},
    {"ORD", "c", "i", "Code of a character."},
    {"SIZEOF", "a", "i", "Number of elements of an array or list, or of characters of a string."},
    {"CROSS", "pp", "p", "Vector product of two positions."},
    {"DOT", "pp", "r", "Scalar product of two positions."},
    {"ORIXYZ", "rrr", "o", "Rx(a) Ry(b) Rz(c), degrees."},
    {"ORIYXZ", "rrr", "o", "Ry(a) Rx(b) Rz(c), degrees."},
    {"ORIZYX", "rrr", "o", "Rz(a) Ry(b) Rx(c), degrees."},
    {"ORIZYZ2", "rrr", "o", "Rz(a) Ry(b) Rz(c), degrees."},
    {"ORIRS", "rrr", "o", "Rz(c) Ry(b) Rx(a): roll a, pitch b, yaw c, degrees."},
    {"ORIVANG", "pr", "o", "Rotation about an axis by an angle in degrees."},
    {"ORIQUAT", "rrrr", "o", "Orientation of a quaternion, scalar first."},
    {"ORIMAT", "ppp", "o", "Orientation with the axes n, o, a."},
    {"ORIMULT", "oo", "o", "Product of two orientations, as p @ q."},
    {"ANGLEX", "so", "r", "Angle about x, 0 to 360 degrees, of a mode: 'RS', 'XYZ', 'YXZ', 'ZYX'."},
    {"ANGLEY", "so", "r", "Angle about y of a mode."},
    {"ANGLEZ", "so", "r", "Angle about z of a mode; the first one of 'ZYZ2'."},
    {"ANGLEZ2", "so", "r", "The second angle about z of the mode 'ZYZ2'."},
    {"QUATA", "o", "r", "Scalar part of the quaternion."},
    {"QUATB", "o", "r", "x of the quaternion's vector part."},
    {"QUATC", "o", "r", "y of the quaternion's vector part."},
    {"QUATD", "o", "r", "z of the quaternion's vector part."},
    {"ROTANGLE", "o", "r", "Angle of the rotation, 0 to 180 degrees."},
    {"ROTAXIS", "o", "p", "Axis of the rotation, of length 1."},
    {"VECTORN", "o", "p", "First column of the rotation matrix."},
    {"VECTORO", "o", "p", "Second column of the rotation matrix."},
    {"VECTORA", "o", "p", "Third column of the rotation matrix."},
    {"INV", "P", "P", "Inverse of a pose."},
    {"TRAFO", "J", "T", "Target that joints reach (forward kinematics)."},
    {"TRAFOINV", "T", "J", "Joints that reach a target (inverse kinematics)."},
    {"COMPARE", "ss", "i", "0 if two strings are equal, else -1 or 1 by their order."},
    {"CONCAT", "ss", "s", "Joins two strings."},
    {"LENGTH", "s", "i", "Number of characters."},
    {"LOCATE", "ss", "i",
     "Place where the second string begins in the first: 1 is the first character, 0 not found."},
    {"EXTRACT", "sii", "s",
     "Part of a string: place of its first character (1 is the first) and number of characters."},
    {"DELETE", "Bii", "",
     "Removes characters of a string: place of the first one and number of characters."},
    {"LIST_ADD", "Le", "", "Adds an element at the end of a list."},
    {"LIST_INSERT", "Lie", "", "Inserts an element before the one at a place; 1 is the first."},
    {"LIST_DELETE", "Li", "", "Removes the element at a place of a list; 1 is the first."},
    {"LIST_CLEAR", "L", "", "Removes all elements of a list."},
    {"LIST_INDEX", "le", "i",
     "Place of the first element equal to a value; 0 if the list has none."},
    {"OPEN", "Fss", "", "Opens a file by its name: 'R' reads, 'W' writes, 'A' appends."},
    {"CLOSE", "F", "", "Closes a file."},
    {"EOF", "F", "b", "TRUE if the file has been read to its end."},
    {"EOL", "F", "b", "TRUE if the present line of the file has been read to its end."},
    {"WRITE", "w", "", "Writes values to the messages or to a file."},
    {"WRITELN", "w", "", "Writes values to the messages or to a file and ends the line."},
    {"READ", "m", "", "Reads values from the operator or from a file."},
    {"READLN", "m", "", "Reads values and skips the rest of the line."},
    {"ACQUIRE", "S", "", "Waits until a semaphore is above zero and decrements it."},
    {"RELEASE", "S", "", "Increments a semaphore."},
    {"GETSTATUS", "x", "i", "State of a process, R_PROCESS_READY to R_PROCESS_BLOCKED."},
    {"BRAKE", "q", "",
     "Brakes the motion that an interrupt came into, or that of a robot: BRAKE(mode, robot). Mode "
     "0 ends the motion; 1 holds it until the interrupt's routine has ended."},
    {"R_JOINT_ACT", "", "J", "Present joints of the program's robot."},
    {"R_ROBTARGET_ACT", "", "T",
     "Present pose of the tool, in the frame of the targets, with status and turns."},
    {"R_FLANGE_ACT", "", "P",
     "Present pose of the flange, in the frame of the targets, whatever tool the robot has."},
    {"R_SPEED_ACT", "", "r", "Present speed of the tool [mm/s]."},
    {"R_ACT_ROB", "", "R",
     "Robot of this process's motions without ACT_ROB; may be assigned: R_ACT_ROB := arm."},
}};

}  // namespace

std::span<const Intrinsic> intrinsics() { return kAll; }

std::optional<double> evaluate(std::string_view name, std::span<const double> x) {
  const auto f = number_function(name);
  return f ? number_value(*f, x) : std::nullopt;
}

constexpr std::string_view kPredefinedText = R"(PROGRAM predefined;
CONST
  INT: R_PROCESS_READY := 0, R_PROCESS_RUNNING := 1, R_PROCESS_STOPPED := 2,
       R_PROCESS_BLOCKED := 3;
  INT: TCP_KEEP := 1, TCP_KEEP_REL := 2, DEVICE_REL := 3;
TYPE
  RECORD REAL: X, Y, Z; ENDRECORD: POSITION;
  RECORD REAL: Q1, Q2, Q3, Q4; ENDRECORD: ORIENTATION;
  RECORD POSITION: POS; ORIENTATION: ORI; ENDRECORD: POSE;
VAR
  REAL: R_C_CP := 0.0, R_SPEED := 250.0, R_SPEED_ORI := 90.0, R_C_SPEED := 100.0, R_ACC := 100.0;
  REAL: R_WOBBLE_AMPLITUDE := 2.0, R_WOBBLE_LENGTH := 6.0;
  REAL: R_C_PTP := 0.0, R_SPEED_PTP := 100.0, R_ACC_PTP := 100.0;
  REAL: R_MOVE_TIME := -1.0, R_SCALE_FORW, R_SCALE_BACK, R_DISTANCE_FORW, R_DISTANCE_BACK;
  BOOL: R_TIMEOUT;
ENDPROGRAM;
)";
constexpr std::string_view kStandardText = R"(PROGRAM standard;
{ A robot of six axes with one additional axis, such as a gripper. }
CONST
  INT: R_NTURNS := 2, R_NADDJ := 1, R_NJ := 7, R_DEVICE_NUMBER := 1;
  STRING: RS := 'RS', XYZ := 'XYZ', YXZ := 'YXZ', ZYX := 'ZYX', ZYZ2 := 'ZYZ2', VANG := 'VANG',
          QUAT := 'QUAT';
  STRING: R_DEF_ORI := ZYX;
  INT: AX_NONE := -1, AX_MAIN := 0, ADAX_IS := 1, ADAX_IE := 2, ADAX_EX := 3;
  INT: NO_ADAX_CONTROL := 0, NO_PRED := -1;
TYPE
  RECORD REAL: LOWER, UPPER; ENDRECORD: BOUNDS;
  RECORD REAL: A1, A2, A3, A4, A5, A6; ENDRECORD: MAIN_JOINT;
  RECORD REAL: AA1; ENDRECORD: ADD_JOINT;
  RECORD MAIN_JOINT: M_JOINT; ADD_JOINT: A_JOINT; ENDRECORD: JOINT;
  RECORD
    POSE: PSE;
    INT: STATUS;
    ARRAY [1..R_NTURNS] OF INT: TURNS;
    ADD_JOINT: A_JOINT;
  ENDRECORD: ROBTARGET;
ENDPROGRAM;
)";
const std::string_view kPredefined = kPredefinedText;
const std::string_view kStandardCell = kStandardText;

}  // namespace robomosp::irl
