/* SPDX-License-Identifier: Apache-2.0
 * Programs as their compiler hands them over: a typed, structured program and three-address code,
 * in flat tables of plain C (layer: contract). Whoever reads them needs neither C++ nor exceptions.
 *
 * Rows are named by their number; RMP_NONE is no row. Tables have the length of a row, so that rows
 * may grow at their end: read them with rmp_row(), and what came later after RMP_ROW_HAS.
 * Enumerators keep their numbers; new ones come at the end, and a reader refuses those that it does
 * not know. Lengths are in mm and angles in degrees, as programs of robots have them. */
#pragma once

#include <stddef.h>
#include <stdint.h>

#include <robomosp/sdk/plugin.h>

#define RMP_NONE 0xffffffffu

/** Rows of one table. */
typedef struct rmp_table {
  const void* rows;
  uint32_t count;
  uint32_t row_size;
} rmp_table;

/** Row `i` of a table. */
static inline const void* rmp_row(const rmp_table* table, uint32_t i) {
  return (const char*)table->rows + (size_t)i * table->row_size;
}
/** Whether the rows of a table reach as far as this field. */
#define RMP_ROW_HAS(table, type, field) \
  (offsetof(type, field) + sizeof(((type*)0)->field) <= (table)->row_size)

/** A place in a source. Never grows. */
typedef struct rmp_span {
  uint32_t file;         /**< of the files */
  uint32_t line, column; /**< of its first byte, 1 is the first */
  uint32_t begin, end;   /**< bytes of the file's text, [begin, end) */
} rmp_span;

/** A source file. */
typedef struct rmp_code_file {
  const char* name;
} rmp_code_file;

enum rmp_fault_severity { RMP_FAULT_ERROR = 0, RMP_FAULT_WARNING = 1, RMP_FAULT_NOTE = 2 };
/** Something wrong with the source. With an error there is no three-address code. */
typedef struct rmp_code_fault {
  uint32_t severity;
  rmp_span span;
  const char* message; /**< without a trailing period */
  const char* hint;    /**< what to do, a sentence; may be "" */
} rmp_code_fault;

/** The first rows of the types are those up to RMP_TYPE_PROCESS, in this order. */
enum rmp_type_kind {
  RMP_TYPE_VOID = 0,
  RMP_TYPE_INT = 1,  /**< 32 bits with sign */
  RMP_TYPE_REAL = 2, /**< binary64 */
  RMP_TYPE_CHAR = 3, /**< one byte */
  RMP_TYPE_BOOL = 4,
  RMP_TYPE_STRING = 5,    /**< bytes, any number */
  RMP_TYPE_TEXT = 6,      /**< a file of lines */
  RMP_TYPE_FILE = 7,      /**< a file of values */
  RMP_TYPE_SEMAPHORE = 8, /**< a count */
  RMP_TYPE_PROCESS = 9,   /**< a parallel process, named */
  RMP_TYPE_ARRAY = 10,
  RMP_TYPE_RECORD = 11,
  RMP_TYPE_LIST = 12
};
/** What a record means to motions. */
enum rmp_type_role {
  RMP_ROLE_NONE = 0,
  RMP_ROLE_POSITION = 1,    /**< X, Y, Z [mm] */
  RMP_ROLE_ORIENTATION = 2, /**< unit quaternion, scalar first */
  RMP_ROLE_POSE = 3,        /**< position, orientation */
  RMP_ROLE_MAIN_JOINT = 4,  /**< the robot's joints [degrees, mm] */
  RMP_ROLE_ADD_JOINT = 5,   /**< additional joints */
  RMP_ROLE_JOINT = 6,       /**< both */
  RMP_ROLE_ROBTARGET = 7,   /**< pose, status, turns, additional joints */
  RMP_ROLE_ROBOT = 8        /**< what a cell says of a robot */
};
typedef struct rmp_code_type {
  uint32_t kind;
  uint32_t role;
  const char* name;     /**< "" = it has none */
  uint32_t element;     /**< array, list: type of an element */
  uint32_t first_field; /**< record */
  uint32_t field_count;
  int32_t lower, upper; /**< array: bounds, both within */
  rmp_span span;
} rmp_code_type;
/** A field of a record. */
typedef struct rmp_code_field {
  const char* name;
  uint32_t type;
  rmp_span span;
} rmp_code_field;

enum rmp_constant_kind { RMP_CONSTANT_INT = 0, RMP_CONSTANT_REAL = 1, RMP_CONSTANT_TEXT = 2 };
/** A value that is known. BOOL and CHAR are numbers. */
typedef struct rmp_code_constant {
  uint32_t kind;
  uint32_t type;
  int64_t integer;
  double real;
  const char* text;
  uint64_t text_size;
} rmp_code_constant;

enum rmp_scope_kind {
  RMP_SCOPE_PREDEFINED = 0,
  RMP_SCOPE_SYSTEM = 1, /**< the system specification */
  RMP_SCOPE_MODULE = 2,
  RMP_SCOPE_PROGRAM = 3,
  RMP_SCOPE_ROUTINE = 4
};
typedef struct rmp_code_scope {
  uint32_t kind;
  uint32_t parent; /**< where names are looked up next */
  const char* name;
  rmp_span span;
} rmp_code_scope;

enum rmp_symbol_kind {
  RMP_SYMBOL_CONSTANT = 0,
  RMP_SYMBOL_VARIABLE = 1,
  RMP_SYMBOL_PARAMETER = 2,
  RMP_SYMBOL_INPUT = 3,  /**< a signal that is read */
  RMP_SYMBOL_OUTPUT = 4, /**< a signal that is written, and may be read */
  RMP_SYMBOL_ROBOT = 5,  /**< a variable that describes a robot */
  RMP_SYMBOL_TYPE = 6,
  RMP_SYMBOL_ROUTINE = 7,
  RMP_SYMBOL_LABEL = 8,
  RMP_SYMBOL_INTRINSIC = 9, /**< a function or procedure of the language */
  RMP_SYMBOL_IMPORT = 10    /**< `value` is the symbol of the module */
};
enum rmp_parameter_mode { RMP_MODE_IN = 0, RMP_MODE_OUT = 1, RMP_MODE_INOUT = 2 };
typedef struct rmp_code_symbol {
  uint32_t kind;
  uint32_t mode;    /**< parameter */
  const char* name; /**< as it was declared */
  uint32_t type;
  uint32_t scope;
  uint32_t routine;  /**< the routine that it names, or that it belongs to */
  uint32_t value;    /**< initial value, an expression; RMP_NONE = zero */
  uint32_t constant; /**< of a constant, where it is one value that is known */
  int32_t address;   /**< signal: its number */
  int32_t width;     /**< signal: how many from there on */
  rmp_span span;
} rmp_code_symbol;

enum rmp_routine_kind {
  RMP_ROUTINE_PROGRAM = 0,
  RMP_ROUTINE_PROCEDURE = 1,
  RMP_ROUTINE_FUNCTION = 2,
  RMP_ROUTINE_PROCESS = 3,
  RMP_ROUTINE_INTERRUPT = 4,
  RMP_ROUTINE_DATA_LIST = 5 /**< assignments of taught values; run for one variable each */
};
/** Routine 0 is the program. */
typedef struct rmp_code_routine {
  uint32_t kind;
  uint32_t symbol;
  uint32_t scope;
  uint32_t first_parameter; /**< symbols, one behind the other */
  uint32_t parameter_count;
  uint32_t result;    /**< type */
  uint32_t body;      /**< first statement */
  uint32_t priority;  /**< process, interrupt: expression */
  uint32_t condition; /**< interrupt: expression */
  uint32_t first_instruction, instruction_count;
  uint32_t temporary_count, label_count;
  uint32_t is_recursive; /**< calls itself, or what calls it */
  rmp_span span;
} rmp_code_routine;

enum rmp_expression_op {
  RMP_EXPR_LITERAL = 0,   /**< constant */
  RMP_EXPR_SYMBOL = 1,    /**< symbol */
  RMP_EXPR_FIELD = 2,     /**< of operand 0; `symbol` is the field's number in its record */
  RMP_EXPR_INDEX = 3,     /**< operand 0 [operand 1]: array, list, character of a string */
  RMP_EXPR_CALL = 4,      /**< function; operands are its arguments */
  RMP_EXPR_INTRINSIC = 5, /**< the same of the language */
  RMP_EXPR_MAKE = 6,      /**< record, array or list of its operands */
  RMP_EXPR_CONVERT = 7,   /**< operand 0 to its type */
  RMP_EXPR_NEGATE = 8,
  RMP_EXPR_NOT = 9,
  RMP_EXPR_ADD = 10,
  RMP_EXPR_SUBTRACT = 11,
  RMP_EXPR_MULTIPLY = 12,
  RMP_EXPR_DIVIDE = 13, /**< REAL */
  RMP_EXPR_DIV = 14,    /**< INT, towards zero */
  RMP_EXPR_MOD = 15,    /**< remainder of DIV */
  RMP_EXPR_EQUAL = 16,
  RMP_EXPR_NOT_EQUAL = 17,
  RMP_EXPR_LESS = 18,
  RMP_EXPR_LESS_EQUAL = 19,
  RMP_EXPR_GREATER = 20,
  RMP_EXPR_GREATER_EQUAL = 21,
  RMP_EXPR_AND = 22, /**< operand 1 only where 0 is true */
  RMP_EXPR_OR = 23,  /**< operand 1 only where 0 is false */
  RMP_EXPR_EXOR = 24,
  RMP_EXPR_COMPOSE = 25 /**< POSE @ POSE, POSE @ POSITION, ORIENTATION @ ORIENTATION */
};
/** Operands are `count` rows of the links from `first`, each an expression. */
typedef struct rmp_code_expression {
  uint32_t op;
  uint32_t type;
  uint32_t symbol;
  uint32_t constant; /**< where the value is known */
  uint32_t first, count;
  rmp_span span;
} rmp_code_expression;

enum rmp_statement_op {
  RMP_STMT_ASSIGN = 0, /**< a := b */
  RMP_STMT_CALL = 1,   /**< expression a */
  RMP_STMT_IF = 2,     /**< arms: the first with a true condition */
  RMP_STMT_ARM = 3,  /**< of IF: condition a, none = else; of CASE: labels are links, none = else */
  RMP_STMT_CASE = 4, /**< selector a, arms */
  RMP_STMT_WHILE = 5,  /**< condition a */
  RMP_STMT_REPEAT = 6, /**< until a */
  RMP_STMT_LOOP = 7,
  RMP_STMT_FOR = 8,        /**< symbol from a to b by c (none = 1) */
  RMP_STMT_FOR_DOWN = 9,   /**< the same downwards */
  RMP_STMT_EXIT = 10,      /**< leaves the innermost loop */
  RMP_STMT_GOTO = 11,      /**< symbol */
  RMP_STMT_LABEL = 12,     /**< symbol */
  RMP_STMT_RETURN = 13,    /**< a, or none */
  RMP_STMT_WAIT_TIME = 14, /**< a [s] */
  RMP_STMT_WAIT_FOR = 15,  /**< condition a, at most b [s] */
  RMP_STMT_PAUSE = 16,     /**< message a, or none */
  RMP_STMT_HALT = 17,
  RMP_STMT_MOVE = 18,  /**< motion */
  RMP_STMT_START = 19, /**< the process `symbol`; so are the next three */
  RMP_STMT_STOP = 20,
  RMP_STMT_CONTINUE = 21,
  RMP_STMT_CANCEL = 22,
  RMP_STMT_ENABLE = 23, /**< the interrupt `symbol` */
  RMP_STMT_DISABLE = 24,
  RMP_STMT_TEACH = 25 /**< the variable `symbol` gets its taught value */
};
typedef struct rmp_code_statement {
  uint32_t op;
  uint32_t next; /**< in its block */
  uint32_t a, b, c;
  uint32_t body; /**< first statement within */
  uint32_t symbol;
  uint32_t motion;
  uint32_t first, count; /**< links */
  rmp_span span;
} rmp_code_statement;

enum rmp_interpolation {
  RMP_MOVE_PTP = 0,
  RMP_MOVE_LIN = 1,
  RMP_MOVE_CIRCLE = 2, /**< through the first target to the second */
  RMP_MOVE_PATH = 3    /**< a smooth curve through all targets */
};
typedef struct rmp_code_motion {
  uint32_t interpolation;
  uint32_t is_incremental; /**< targets are added to the pose before, in the base frame */
  uint32_t first_target, target_count; /**< links: expressions; their types' roles define them */
  uint32_t first_attribute, attribute_count;
  uint32_t until;  /**< condition that ends it early */
  uint32_t action; /**< routine that is called then */
  rmp_span span;
} rmp_code_motion;

enum rmp_motion_attribute {
  RMP_ATTR_SPEED = 0,     /**< [mm/s] */
  RMP_ATTR_SPEED_ORI = 1, /**< [degrees/s] */
  RMP_ATTR_ACC = 2,       /**< [% of the greatest] */
  RMP_ATTR_TIME = 3,      /**< of the whole motion [s]; -1 = none */
  RMP_ATTR_C_CP = 4,      /**< distance at which it may leave its path for the next [mm] */
  RMP_ATTR_C_SPEED = 5,   /**< speed in the transition [%] */
  RMP_ATTR_C_PASS = 6,    /**< whether it passes its target without a stop */
  RMP_ATTR_WOBBLE = 7,    /**< whether the tool weaves */
  RMP_ATTR_ACT_ROB = 8,   /**< the robot that moves */
  RMP_ATTR_DEVICE = 9,
  RMP_ATTR_ADAX_CONTROL = 10,
  RMP_ATTR_SPEED_PTP = 11, /**< [% of the greatest] */
  RMP_ATTR_ACC_PTP = 12,   /**< [%] */
  RMP_ATTR_C_PTP = 13,     /**< [%] */
  RMP_ATTR_TOOL = 14,      /**< flange_T_tool of this motion */
  RMP_ATTR_FRAME = 15      /**< base_T_frame that the targets are in */
};
typedef struct rmp_code_attribute {
  uint32_t attribute;
  uint32_t value; /**< expression */
  rmp_span span;
} rmp_code_attribute;

/** Fields of an instruction, as the text form prints them. */
enum rmp_operand_kind {
  RMP_OPERAND_NONE = 0,      /**< - */
  RMP_OPERAND_CONSTANT = 1,  /**< index: constants; 5, 0.5, 'text', TRUE */
  RMP_OPERAND_VARIABLE = 2,  /**< index: symbols; v12 */
  RMP_OPERAND_TEMPORARY = 3, /**< index: of its routine, from 0; t3 */
  RMP_OPERAND_REFERENCE = 4, /**< the same, a place in a variable; p3 */
  RMP_OPERAND_LABEL = 5,     /**< of its routine, from 0; L2 */
  RMP_OPERAND_ROUTINE = 6,   /**< r4 */
  RMP_OPERAND_NUMBER = 7,    /**< a plain number: a count, a field's; #2 */
  RMP_OPERAND_WORD = 8,      /**< an enumerator of the op: interpolation, attribute; #1 */
  RMP_OPERAND_INTRINSIC = 9  /**< index: symbols; SIN */
};
typedef struct rmp_code_operand {
  uint32_t kind;
  uint32_t type;
  int64_t index;
} rmp_code_operand;

/** `a op b -> r` unless documented otherwise. */
enum rmp_instruction_op {
  RMP_OP_COPY = 0,    /**< r := a */
  RMP_OP_CONVERT = 1, /**< r := a as the type of r */
  RMP_OP_NEGATE = 2,
  RMP_OP_NOT = 3,
  RMP_OP_ADD = 4,
  RMP_OP_SUBTRACT = 5,
  RMP_OP_MULTIPLY = 6,
  RMP_OP_DIVIDE = 7,
  RMP_OP_DIV = 8,
  RMP_OP_MOD = 9,
  RMP_OP_EQUAL = 10,
  RMP_OP_NOT_EQUAL = 11,
  RMP_OP_LESS = 12,
  RMP_OP_LESS_EQUAL = 13,
  RMP_OP_GREATER = 14,
  RMP_OP_GREATER_EQUAL = 15,
  RMP_OP_EXOR = 16,
  RMP_OP_COMPOSE = 17,
  RMP_OP_FIELD = 18, /**< r: place of field number b in a */
  RMP_OP_ELEMENT =
      19,            /**< r: place of element b in a; outside the bounds is an error at run time */
  RMP_OP_LOAD = 20,  /**< r := the value at a */
  RMP_OP_STORE = 21, /**< at r := a */
  RMP_OP_ARGUMENT = 22,       /**< a for the next CALL, INTRINSIC or MAKE */
  RMP_OP_ARGUMENT_PLACE = 23, /**< the same, a place (OUT, INOUT) */
  RMP_OP_CALL = 24,           /**< routine a with b arguments -> r */
  RMP_OP_INTRINSIC = 25,      /**< the same of the language */
  RMP_OP_MAKE = 26,           /**< b arguments as a record, array or list -> r */
  RMP_OP_LABEL = 27,          /**< r */
  RMP_OP_JUMP = 28,           /**< to r */
  RMP_OP_JUMP_IF = 29,        /**< to r where a is true */
  RMP_OP_JUMP_UNLESS = 30,
  RMP_OP_RETURN = 31,    /**< a, or none */
  RMP_OP_WAIT_TIME = 32, /**< a [s] */
  RMP_OP_WAIT_BEGIN =
      33, /**< at most a [s]; none = for ever. The condition follows behind a label */
  RMP_OP_WAIT_TEST = 34, /**< where a is false and time is left: in the next cycle at r */
  RMP_OP_PAUSE = 35,
  RMP_OP_HALT = 36,
  RMP_OP_TARGET = 37,    /**< a for the next MOVE */
  RMP_OP_ATTRIBUTE = 38, /**< attribute b is a, for the next MOVE */
  RMP_OP_UNTIL = 39,     /**< the next MOVE ends early by the condition behind this; continues at r;
                            a = routine that is called then */
  RMP_OP_UNTIL_TEST = 40, /**< end of that condition: a */
  RMP_OP_MOVE = 41,       /**< interpolation a; b = 1 incremental */
  RMP_OP_START = 42,      /**< process a; priority b */
  RMP_OP_STOP = 43,
  RMP_OP_CONTINUE = 44,
  RMP_OP_CANCEL = 45,
  RMP_OP_ENABLE = 46, /**< interrupt a; priority b */
  RMP_OP_DISABLE = 47,
  RMP_OP_INTERRUPT_TEST = 48, /**< end of an interrupt's condition, which begins its routine: a */
  RMP_OP_TEACH = 49           /**< variable a gets its taught value */
};
/** One line of three-address code: what is done, and three fields. */
typedef struct rmp_code_instruction {
  uint32_t op;
  rmp_code_operand a, b, r;
  rmp_span span;
} rmp_code_instruction;

/** A program. `struct_size` lets it grow at its end. */
typedef struct rmp_code {
  uint32_t struct_size;
  uint32_t has_errors;
  const char* name;
  rmp_table files;        /**< rmp_code_file */
  rmp_table faults;       /**< rmp_code_fault, in order of file and place */
  rmp_table types;        /**< rmp_code_type */
  rmp_table fields;       /**< rmp_code_field */
  rmp_table constants;    /**< rmp_code_constant */
  rmp_table scopes;       /**< rmp_code_scope */
  rmp_table symbols;      /**< rmp_code_symbol */
  rmp_table routines;     /**< rmp_code_routine */
  rmp_table expressions;  /**< rmp_code_expression */
  rmp_table statements;   /**< rmp_code_statement */
  rmp_table motions;      /**< rmp_code_motion */
  rmp_table attributes;   /**< rmp_code_attribute */
  rmp_table links;        /**< uint32_t */
  rmp_table instructions; /**< rmp_code_instruction */
} rmp_code;
