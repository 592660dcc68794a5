// SPDX-License-Identifier: Apache-2.0
#include "model/program_kinds.h"

#include "model/controller.h"
#include "model/declare.h"
#include "model/program.h"

namespace robomosp {

Kind program_kind() {
  static const Kind kind = model::register_kind_of<model::Program>("program", ".prg", "programs");
  return kind;
}

Kind controller_kind() {
  static const Kind kind =
      model::register_kind_of<model::Controller>("controller", ".ctl", "controllers");
  return kind;
}

}  // namespace robomosp
