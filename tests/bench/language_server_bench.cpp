// SPDX-License-Identifier: Apache-2.0
// What an editor waits for behind a key: a change of one letter and a completion, from the bytes of
// the request to those of the answer.
#include <unistd.h>

#include <string>
#include <string_view>
#include <thread>

#include <benchmark/benchmark.h>
#include <nlohmann/json.hpp>

#include "ioci/core/application.h"
#include "remote/language_server.h"

namespace robomosp::remote {
namespace {

using Json = nlohmann::json;

/// A server on a thread of its own, at the other end of two pipes.
class Editor {
 public:
  explicit Editor(ioci::Application& app) {
    if (::pipe(to_) != 0 || ::pipe(from_) != 0) return;
    server_ = std::thread([this, &app] { (void)serve_editor(app, to_[0], from_[1]); });
  }
  Editor(const Editor&) = delete;
  Editor& operator=(const Editor&) = delete;
  ~Editor() {
    ::close(to_[1]);
    if (server_.joinable()) server_.join();
    for (const int fd : {to_[0], from_[0], from_[1]}) ::close(fd);
  }
  void tell(const char* method, const Json& params) {
    send({{"jsonrpc", "2.0"}, {"method", method}, {"params", params}});
  }
  /// The bytes of the answer.
  std::string ask(const char* method, const Json& params) {
    const int id = ++id_;
    send({{"jsonrpc", "2.0"}, {"id", id}, {"method", method}, {"params", params}});
    const std::string wanted = "\"id\":" + std::to_string(id) + ",";
    for (;;) {
      std::string body = next();
      if (body.empty() || body.find(wanted) != std::string::npos) return body;
    }
  }

 private:
  void send(const Json& message) {
    const std::string body = message.dump();
    std::string all = "Content-Length: " + std::to_string(body.size()) + "\r\n\r\n" + body;
    for (std::string_view left = all; !left.empty();) {
      const ssize_t n = ::write(to_[1], left.data(), left.size());
      if (n <= 0) return;
      left.remove_prefix(static_cast<std::size_t>(n));
    }
  }
  bool more() {
    char chunk[1 << 16];
    const ssize_t n = ::read(from_[0], chunk, sizeof chunk);
    if (n > 0) got_.append(chunk, static_cast<std::size_t>(n));
    return n > 0;
  }
  std::string next() {
    constexpr std::string_view kLength = "Content-Length: ";
    std::size_t head = 0;
    while ((head = got_.find("\r\n\r\n")) == std::string::npos)
      if (!more()) return {};
    const std::size_t at = got_.find(kLength);
    const std::size_t size = std::stoul(got_.substr(at + kLength.size()));
    while (got_.size() < head + 4 + size)
      if (!more()) return {};
    std::string body = got_.substr(head + 4, size);
    got_.erase(0, head + 4 + size);
    return body;
  }
  int to_[2] = {-1, -1}, from_[2] = {-1, -1};
  int id_ = 0;
  std::string got_;
  std::thread server_;
};

/// Letters typed in a program of 10,000 lines.
void LanguageServerCompletion10000Lines(benchmark::State& state) {
  auto app = ioci::Application::create({.plugin_path = {ROBOMOSP_PLUGIN_DIR}, .library = {}});
  if (!app.ok()) return state.SkipWithError(app.error().sentence().c_str());
  Editor editor(**app);
  std::string text = "PROGRAM p;\nVAR\n  INT: i;\n  POSE: place;\n";
  int lines = 4;
  for (int n = 0; n < 1000; ++n, lines += 10) {
    const std::string k = std::to_string(n);
    text += "PROCEDURE f" + k + " (IN INT: a);\nVAR\n  INT: own" + k + ";\nBEGIN\n  own" + k +
            " := a + i * 2;\n  IF own" + k + " > 3 THEN\n    MOVE LIN place SPEED := 80.0;\n" +
            "    i := 1;\n  ENDIF;\nENDPROC;\n";
  }
  text += "BEGIN\n  i := 1;\nENDPROGRAM;\n";
  const Json document{{"uri", "file:///p.irl"}};
  const auto at = [&](int character) {
    return Json{{"line", lines + 1}, {"character", character}};
  };
  (void)editor.ask("initialize", {{"capabilities", Json::object()}});
  editor.tell(
      "textDocument/didOpen",
      {{"textDocument",
        {{"uri", document["uri"]}, {"languageId", "irl"}, {"version", 1}, {"text", text}}}});
  int version = 1;
  std::size_t bytes = 0;
  for (auto _ : state) {
    // Typed, and taken back: each text is another one.
    const bool is_there = version % 2 == 0;
    editor.tell("textDocument/didChange",
                {{"textDocument", {{"uri", document["uri"]}, {"version", ++version}}},
                 {"contentChanges",
                  {{{"range", {{"start", at(2)}, {"end", at(is_there ? 3 : 2)}}},
                    {"text", is_there ? "" : "f"}}}}});
    const std::string answer =
        editor.ask("textDocument/completion",
                   {{"textDocument", document}, {"position", at(is_there ? 2 : 3)}});
    if (answer.find("\"items\":[{") == std::string::npos) state.SkipWithError("there are no items");
    bytes = answer.size();
  }
  state.counters["bytes"] = static_cast<double>(bytes);
}
BENCHMARK(LanguageServerCompletion10000Lines)->Unit(benchmark::kMillisecond)->UseRealTime();

}  // namespace
}  // namespace robomosp::remote
