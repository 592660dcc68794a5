// SPDX-License-Identifier: Apache-2.0
#include "ioci/recording/plot_answer.h"
#include "ioci/core/loaded.h"

#include "io/native.h"
#include "ioci/core/word_list.h"
#include "kernel/base64.h"

namespace robomosp::ioci {

ParamSpec plot_answer_field() {
  return choice("as", {"text", "svg", "png"},
                "Result without a file: characters, the text of an SVG picture, or the bytes of a "
                "PNG as base64 (through gnuplot).");
}

Result<Value> plot_answer(CommandContext& ctx, recording::PlotRequest request, const Map& args,
                          std::vector<std::string> columns) {
  request.is_path = text_of(args, "kind") == "path";
  if (has(args, "title")) request.title = text_of(args, "title");
  RMP_TRY_ASSIGN(request.columns, word_list(args, "columns"));
  if (request.columns.empty() && !request.is_path) request.columns = std::move(columns);
  request.width = static_cast<int>(integer(args, "width"));
  if (has(args, "height")) request.height = static_cast<int>(integer(args, "height"));
  RMP_TRY_ASSIGN(const recording::Plot drawn, recording::plot(request));
  if (drawn.left_out > 0)
    ctx.app.messages.post(Severity::warning, "logarithmic_axis",
                          std::to_string(drawn.left_out) + " of " + std::to_string(drawn.samples) +
                              (drawn.left_out == 1 ? " samples has" : " samples have") +
                              " a value of 0 or less; a logarithmic axis leaves " +
                              (drawn.left_out == 1 ? "it" : "them") + " out.",
                          "recording");
  const std::string as = text_of(args, "as");
  if (!has(args, "file")) {
    if (as == "text") return Value(recording::to_text(drawn));
    RMP_TRY_ASSIGN(std::string bytes, recording::plot_file(drawn, "plot." + as));
    if (as == "svg") return Value(std::move(bytes));
    std::string text;
    base64::append(text, bytes);
    return Value(std::move(text));
  }
  if (as != "text")
    return error(ErrorCode::invalid_argument,
                 "a plot is either written to a file or returned, but both are requested",
                 "Leave out file or as; a file's extension selects its format.", "as");
  const std::string file = text_of(args, "file");
  RMP_TRY_ASSIGN(const std::string bytes, recording::plot_file(drawn, file));
  RMP_TRY(write_named_file(ctx, file, bytes));
  return Value(file);
}

}  // namespace robomosp::ioci
