// SPDX-License-Identifier: Apache-2.0
#include "ioci/recording/plot_answer.h"

#include "io/native.h"
#include "ioci/core/word_list.h"

namespace robomosp::ioci {

Result<Value> plot_answer(recording::PlotRequest request, const Map& args,
                          std::vector<std::string> columns) {
  request.is_path = text_of(args, "kind") == "path";
  if (has(args, "title")) request.title = text_of(args, "title");
  RMP_TRY_ASSIGN(request.columns, word_list(args, "columns"));
  if (request.columns.empty() && !request.is_path) request.columns = std::move(columns);
  request.width = static_cast<int>(integer(args, "width"));
  if (has(args, "height")) request.height = static_cast<int>(integer(args, "height"));
  RMP_TRY_ASSIGN(const recording::Plot drawn, recording::plot(request));
  if (!has(args, "file")) return Value(recording::to_text(drawn));
  const std::string file = text_of(args, "file");
  RMP_TRY_ASSIGN(const std::string bytes, recording::plot_file(drawn, file));
  RMP_TRY(io::write_file(file, bytes));
  return Value(file);
}

}  // namespace robomosp::ioci
