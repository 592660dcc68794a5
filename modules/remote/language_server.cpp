// SPDX-License-Identifier: Apache-2.0
// One thread: it reads what there is, answers the oldest request, and checks programs when nothing
// else is to be done. Long work looks at the input, so that it can be cancelled.
#include "remote/language_server.h"

#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <deque>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

#include <robomosp/sdk/language_editing.h>

#include "io/native.h"
#include "ioci/program/program_files.h"
#include "kernel/file_root.h"
#include "kernel/text.h"
#include "motion/provider_params.h"
#include "program/open_editing.h"
#include "program/source_bytes.h"
#include "remote/edited_text.h"
#include "remote/framed_messages.h"

namespace robomosp::remote {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

constexpr std::size_t kMostDocuments = 1000;
constexpr std::size_t kMostText = std::size_t{256} << 20;  ///< bytes of all open documents
constexpr std::uint64_t kMostBeside = std::uint64_t{16}
                                      << 20;  ///< of a file that is read from disk
constexpr std::size_t kMostFiles = 100;       ///< of a program
constexpr std::size_t kMostPrograms = 8;      ///< that are kept
constexpr std::uint64_t kMostWork = std::uint64_t{4}
                                    << 30;  ///< bytes that changes of one message go over
/// How long nothing comes before programs are checked [ms]: completion behind a key comes first.
constexpr int kQuiet = 40;
constexpr std::size_t kMostItems = 200;  ///< of a completion
constexpr std::size_t kMostWaitingMessages = std::size_t{64}
                                             << 20;  ///< bytes that wait to be answered

// Codes of the protocol.
constexpr int kEditorParseError = -32700, kEditorInvalidRequest = -32600,
              kEditorUnknownMethod = -32601, kEditorInvalidParams = -32602,
              kNotInitialized = -32002, kCancelled = -32800, kContentModified = -32801,
              kFailed = -32803;

struct ServerFailure {
  int code = kFailed;
  std::string message;
};
ServerFailure failure(const Error& e) {
  return {e.code == ErrorCode::cancelled ? kCancelled : kFailed, e.sentence()};
}

// ---- the server ----

struct Document {
  std::string uri, name;
  std::int64_t version = 0;
  std::shared_ptr<const Text> text;
  std::uint64_t order = 0;  ///< of opening
  std::vector<std::string> needs;
  std::shared_ptr<const Text> needs_of;  ///< the text that `needs` were read from
  bool is_due = false;                   ///< its faults are to be told
  /// What they were told of the last time: the files of its program, and its version.
  std::vector<std::pair<std::string, std::shared_ptr<const Text>>> told;
  std::int64_t told_version = 0;
};
struct ProgramFileOfEditor {
  std::string name, uri;
  std::shared_ptr<const Text> text;
};
struct OpenProgram {
  std::vector<ProgramFileOfEditor> files;
  std::string language;
  std::shared_ptr<EditedProgram> program;
  std::uint64_t used = 0;
};
/// A program and a file in it.
struct Where {
  std::shared_ptr<const OpenProgram> program;
  std::uint32_t file = 0;
  [[nodiscard]] const Text& text() const { return *program->files[file].text; }
};

constexpr const char* kTokenTypes[] = {"keyword",  "number",    "string",    "comment",  "operator",
                                       "variable", "parameter", "type",      "property", "function",
                                       "event",    "label",     "namespace", "class"};
constexpr const char* kTokenModifiers[] = {"declaration", "readonly", "defaultLibrary"};

class EditorServer {
 public:
  EditorServer(ioci::Application& app, int in, int out) : app_(app), in_(in), out_(out) {}

  int run() {
    while (!is_over_) {
      const bool is_idle = waiting_.empty() && !any_due();
      if (is_readable_ && waiting_bytes_ < kMostWaitingMessages)
        read(is_idle ? -1 : waiting_.empty() && !is_quiet_ ? kQuiet : 0);
      if (is_broken_) return 1;
      if (!waiting_.empty()) {
        Waiting next = std::move(waiting_.front());
        waiting_.pop_front();
        waiting_bytes_ -= std::min(waiting_bytes_, next.bytes);
        handle(next);
      } else if (any_due() && (!has_read_ || !is_readable_)) {
        tell_faults();
      } else if (!is_readable_) {
        return is_shut_down_ ? 0 : 1;
      }
    }
    return is_shut_down_ ? 0 : 1;
  }

 private:
  struct Waiting {
    Json message;
    std::size_t bytes = 0;
    bool is_cancelled = false;
  };

  // ---- input and output ----

  /// What there is; waits for it as long as `timeout` [ms], -1 = for ever.
  void read(int timeout) {
    has_read_ = false;
    pollfd ready{in_, POLLIN, 0};
    const int n = ::poll(&ready, 1, timeout);
    if (n == 0 && timeout > 0) is_quiet_ = true;
    if (n <= 0) return;
    has_read_ = true;
    is_quiet_ = false;
    char chunk[1 << 16];
    const ssize_t got = ::read(in_, chunk, sizeof chunk);
    if (got < 0 && errno == EINTR) return;
    if (got <= 0) {
      is_readable_ = false;
      return;
    }
    std::string fault;
    const bool fits = frames_.feed(
        {chunk, static_cast<std::size_t>(got)}, [this](std::string body) { take(std::move(body)); },
        fault);
    if (fits) return;
    // Where messages begin is not known any more.
    answer_failure(nullptr, {kEditorParseError, fault + "."});
    is_readable_ = false;
  }
  void take(std::string body) {
    const auto bytes = bytes_of_json(body);
    if (!bytes)
      return answer_failure(nullptr, {kEditorInvalidRequest,
                                      "the message is nested too deep or has too many values."});
    Waiting w;
    w.bytes = *bytes;
    w.message = Json::parse(body, nullptr, false);
    if (w.message.is_discarded())
      return answer_failure(nullptr, {kEditorParseError, "the message is not JSON in UTF-8."});
    if (!w.message.is_object())
      return answer_failure(nullptr, {kEditorInvalidRequest, "a message must be an object."});
    if (string_member(w.message, "method") == "$/cancelRequest") {
      const Json& id = member(member(w.message, "params"), "id");
      if (id.is_null()) return;
      for (Waiting& other : waiting_)
        if (member(other.message, "id") == id) other.is_cancelled = true;
      if (current_ == id) is_current_cancelled_ = true;
      return;
    }
    waiting_bytes_ += w.bytes;
    waiting_.push_back(std::move(w));
  }
  void say(const Json& message) {
    if (!is_broken_ && !write_all(out_, framed(message))) is_broken_ = true;
  }
  void notify(const char* method, Json params) {
    say({{"jsonrpc", "2.0"}, {"method", method}, {"params", std::move(params)}});
  }
  void answer_failure(const Json& id, const ServerFailure& f) {
    say({{"jsonrpc", "2.0"}, {"id", id}, {"error", {{"code", f.code}, {"message", f.message}}}});
  }
  void warn(const std::string& message) {
    constexpr int kWarning = 2;
    notify("window/showMessage", {{"type", kWarning}, {"message", message}});
  }

  /// Work that looks at the input meanwhile.
  class Watched final : public Progress {
   public:
    Watched(EditorServer& server, bool yields) : server_(server), yields_(yields) {}
    void report(double, std::string_view) override {}
    [[nodiscard]] bool cancelled() const override {
      using namespace std::chrono_literals;
      const auto now = std::chrono::steady_clock::now();
      if (now - last_ > 5ms) {
        last_ = now;
        if (server_.is_readable_ && server_.waiting_bytes_ < kMostWaitingMessages) server_.read(0);
      }
      return server_.is_current_cancelled_ || (yields_ && !server_.waiting_.empty());
    }

   private:
    EditorServer& server_;
    bool yields_;  ///< to whatever comes
    mutable std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
  };

  // ---- messages ----

  void handle(const Waiting& w) {
    const Json& m = w.message;
    const Json& id = member(m, "id");
    const bool is_request = m.contains("id");
    if (!m.contains("method")) {
      if (!m.contains("result") && !m.contains("error") && is_request)
        answer_failure(id, {kEditorInvalidRequest, "a request must have a method."});
      return;  // an answer: nothing was asked
    }
    if (is_request && !id.is_number_integer() && !id.is_string())
      return answer_failure(nullptr,
                            {kEditorInvalidRequest, "an id must be a whole number or a string."});
    const std::string method = string_member(m, "method");
    const Json& params = member(m, "params");
    if (method == "exit") {
      is_over_ = true;
      return;
    }
    if (!is_request) {
      if (is_initialized_ && !is_shut_down_) notified(method, params);
      return;
    }
    if (w.is_cancelled) return answer_failure(id, {kCancelled, "the request was cancelled."});
    if (is_shut_down_)
      return answer_failure(id, {kEditorInvalidRequest, "the server has been shut down."});
    if (!is_initialized_ && method != "initialize")
      return answer_failure(id, {kNotInitialized, "initialize must come first."});
    const auto found = methods().find(method);
    if (found == methods().end())
      return answer_failure(id, {kEditorUnknownMethod,
                                 "there is no method " + text::quote(method.substr(0, 80)) + "."});
    current_ = id;
    is_current_cancelled_ = false;
    auto answer = (this->*found->second)(params);
    current_ = nullptr;
    if (answer.index() == 0)
      say({{"jsonrpc", "2.0"}, {"id", id}, {"result", std::move(std::get<0>(answer))}});
    else answer_failure(id, std::get<1>(answer));
    is_current_cancelled_ = false;
  }

  using Answer = std::variant<Json, ServerFailure>;
  using Method = Answer (EditorServer::*)(const Json&);
  static const std::map<std::string, Method, std::less<>>& methods() {
    static const std::map<std::string, Method, std::less<>> all = {
        {"initialize", &EditorServer::initialize},
        {"shutdown", &EditorServer::shutdown},
        {"textDocument/completion", &EditorServer::completion},
        {"completionItem/resolve", &EditorServer::resolve},
        {"textDocument/hover", &EditorServer::hover},
        {"textDocument/definition", &EditorServer::definition},
        {"textDocument/references", &EditorServer::references},
        {"textDocument/documentHighlight", &EditorServer::highlight},
        {"textDocument/rename", &EditorServer::rename},
        {"textDocument/prepareRename", &EditorServer::prepare_rename},
        {"textDocument/formatting", &EditorServer::formatting},
        {"textDocument/rangeFormatting", &EditorServer::formatting},
        {"textDocument/documentSymbol", &EditorServer::symbols},
        {"textDocument/semanticTokens/full", &EditorServer::tokens},
        {"textDocument/signatureHelp", &EditorServer::signature},
        {"textDocument/foldingRange", &EditorServer::folds}};
    return all;
  }

  Answer initialize(const Json& params) {
    if (is_initialized_)
      return ServerFailure{kEditorInvalidRequest, "initialize may be sent only once."};
    is_initialized_ = true;
    const Json& can = member(params, "capabilities");
    const Json& encodings = member(member(can, "general"), "positionEncodings");
    if (encodings.is_array())
      for (const Json& e : encodings)
        if (e == "utf-8") units_ = Units::utf8;
    const Json& document = member(can, "textDocument");
    const Json& formats = member(member(document, "hover"), "contentFormat");
    if (formats.is_array())
      for (const Json& f : formats) has_markdown_ = has_markdown_ || f == "markdown";
    has_tree_ =
        member(member(document, "documentSymbol"), "hierarchicalDocumentSymbolSupport") == true;
    Json legend{{"tokenTypes", Json::array()}, {"tokenModifiers", Json::array()}};
    for (const char* t : kTokenTypes) legend["tokenTypes"].push_back(t);
    for (const char* t : kTokenModifiers) legend["tokenModifiers"].push_back(t);
    constexpr int kIncremental = 2;
    return Json{
        {"serverInfo", {{"name", "robomosp"}, {"version", ROBOMOSP_VERSION}}},
        {"capabilities",
         {{"positionEncoding", units_ == Units::utf8 ? "utf-8" : "utf-16"},
          {"textDocumentSync",
           {{"openClose", true}, {"change", kIncremental}, {"save", Json::object()}}},
          {"completionProvider", {{"triggerCharacters", {".", "'"}}, {"resolveProvider", true}}},
          {"hoverProvider", true},
          {"signatureHelpProvider", {{"triggerCharacters", {"(", ","}}}},
          {"definitionProvider", true},
          {"referencesProvider", true},
          {"documentHighlightProvider", true},
          {"documentSymbolProvider", true},
          {"renameProvider", {{"prepareProvider", true}}},
          {"documentFormattingProvider", true},
          {"documentRangeFormattingProvider", true},
          {"foldingRangeProvider", true},
          {"semanticTokensProvider", {{"legend", legend}, {"full", true}}}}}};
  }
  Answer shutdown(const Json&) {
    is_shut_down_ = true;
    return Json();
  }

  // ---- documents ----

  void notified(const std::string& method, const Json& params) {
    const Json& document = member(params, "textDocument");
    const std::string uri = string_member(document, "uri");
    if (method == "textDocument/didOpen") opened(uri, document);
    else if (method == "textDocument/didChange") changed(uri, params);
    else if (method == "textDocument/didClose") closed(uri);
    else if (method == "textDocument/didSave" || method == "workspace/didChangeWatchedFiles")
      forget_files();
  }
  [[nodiscard]] std::size_t bytes_of_all() const {
    std::size_t n = 0;
    for (const auto& [uri, d] : documents_) n += d.text->all().size();
    return n;
  }
  void opened(const std::string& uri, const Json& document) {
    const Json& all = member(document, "text");
    if (uri.empty() || !all.is_string()) return warn("A document that was opened has no text.");
    if (documents_.size() >= kMostDocuments ||
        bytes_of_all() + all.get_ref<const std::string&>().size() > kMostText)
      return warn(uri + " is not checked: too many or too long documents are open.");
    Document d;
    d.uri = uri;
    d.name = file_name(uri);
    d.version = member(document, "version").is_number_integer()
                    ? member(document, "version").get<std::int64_t>()
                    : 0;
    d.text = std::make_shared<const Text>(all.get<std::string>());
    d.order = ++opened_;
    documents_[uri] = std::move(d);
    due_beside(uri);
  }
  void changed(const std::string& uri, const Json& params) {
    const auto found = documents_.find(uri);
    if (found == documents_.end()) return warn("A document was changed that is not open: " + uri);
    Document& d = found->second;
    const Json& changes = member(params, "contentChanges");
    if (!changes.is_array()) return warn("A change of " + uri + " has no contentChanges.");
    // A key that was typed is one change: the text around it is taken as it is.
    if (auto text = with_one_change(*d.text, changes)) {
      set_text(d, std::move(*text), params);
      return;
    }
    ChangedText now(d.text->all());
    for (const Json& c : changes) {
      if (!member(c, "text").is_string())
        return warn("A change of " + uri + " has no text and was ignored. Open it again.");
      const std::string& with = member(c, "text").get_ref<const std::string&>();
      const Json& range = member(c, "range");
      if (range.is_null()) {
        now.set(with);
      } else {
        const auto l0 = number_member(member(range, "start"), "line"),
                   c0 = number_member(member(range, "start"), "character"),
                   l1 = number_member(member(range, "end"), "line"),
                   c1 = number_member(member(range, "end"), "character");
        if (!l0 || !c0 || !l1 || !c1)
          return warn("A change of " + uri + " has no range and was ignored. Open it again.");
        if (!now.replace(*l0, *c0, *l1, *c1, with, units_))
          return warn("A change of " + uri + " ends before it begins and was ignored.");
      }
      if (now.size() > kMostText)
        return warn(uri + " is too long, and its last change was ignored.");
      if (now.work() > kMostWork)
        return warn("Too many changes of long lines of " + uri +
                    " came at once and were ignored. Open it again.");
    }
    set_text(d, now.all(), params);
  }
  void set_text(Document& d, std::string text, const Json& params) {
    const Json& version = member(member(params, "textDocument"), "version");
    if (version.is_number_integer()) d.version = version.get<std::int64_t>();
    d.text = std::make_shared<const Text>(std::move(text));
    due_beside(d.uri);
  }
  /// Nothing = there are several changes, or something is wrong with it.
  [[nodiscard]] std::optional<std::string> with_one_change(const Text& text,
                                                           const Json& changes) const {
    if (changes.size() != 1) return std::nullopt;
    const Json &c = changes[0], &range = member(c, "range");
    const auto l0 = number_member(member(range, "start"), "line"),
               c0 = number_member(member(range, "start"), "character"),
               l1 = number_member(member(range, "end"), "line"),
               c1 = number_member(member(range, "end"), "character");
    if (!l0 || !c0 || !l1 || !c1 || !member(c, "text").is_string()) return std::nullopt;
    const std::string& with = member(c, "text").get_ref<const std::string&>();
    if (text.all().size() + with.size() > kMostText) return std::nullopt;
    return text.with_change(*l0, *c0, *l1, *c1, with, units_);
  }
  void closed(const std::string& uri) {
    if (documents_.erase(uri) == 0) return;
    notify("textDocument/publishDiagnostics", {{"uri", uri}, {"diagnostics", Json::array()}});
    due_beside(uri);
  }
  void forget_files() {
    beside_.clear();
    due_all();
  }
  void due_all() {
    for (auto& [uri, d] : documents_) d.is_due = true;
  }
  /// Programs are made of files of one folder.
  void due_beside(const std::string& changed) {
    const std::string folder = folder_of(changed);
    for (auto& [uri, d] : documents_)
      if (folder_of(uri) == folder) d.is_due = true;
  }
  [[nodiscard]] bool any_due() const {
    if (is_shut_down_) return false;
    for (const auto& [uri, d] : documents_)
      if (d.is_due) return true;
    return false;
  }

  // ---- programs ----

  struct Provider {
    ProviderInfo info;
    std::shared_ptr<Language> language;
    std::shared_ptr<const Params> params;
  };
  /// The language of a file, by its extension; the default one for those that a program names.
  Result<const Provider*> language_of(const std::string& name) {
    if (providers_.empty()) {
      for (const ProviderInfo& info : app_.registry.list(Language::kInterfaceId)) {
        RMP_TRY_ASSIGN(Provider p, provider(info));
        providers_.push_back(std::move(p));
      }
      RMP_TRY_ASSIGN(const ProviderInfo chosen, app_.registry.find(Language::kInterfaceId, ""));
      std::stable_partition(providers_.begin(), providers_.end(),
                            [&](const Provider& p) { return p.info.name == chosen.name; });
    }
    const std::size_t dot = name.rfind('.');
    std::string extension = dot == std::string::npos ? "" : name.substr(dot + 1);
    for (char& c : extension)
      if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
    for (const Provider& p : providers_)
      for (const std::string_view e : text::split(p.language->extensions(), ','))
        if (!extension.empty() && e == extension) return &p;
    return &providers_.front();
  }
  Result<Provider> provider(const ProviderInfo& info) {
    Provider p;
    p.info = info;
    RMP_TRY_ASSIGN(auto made, app_.registry.create<Language>(info.name));
    p.language = std::move(made);
    model::ProviderChoice choice;
    choice.name = info.name;
    RMP_TRY_ASSIGN(auto params, motion::checked_params(info, choice, "provider " + info.name));
    p.params = std::move(params);
    return p;
  }
  /// Names of files; those of the text before where an answer cannot wait for them.
  const std::vector<std::string>& needs_of(Document& d) {
    if (d.needs_of != d.text && !(is_hurried_ && d.needs_of)) {
      d.needs_of = d.text;
      d.needs.clear();
      const auto p = language_of(d.name);
      if (p.ok()) {
        auto all = (*p)->language->needs(SourceFile{d.name, d.text->all(), {}});
        if (all.ok()) d.needs = std::move(all).value();
      }
    }
    return d.needs;
  }
  static std::string folder_of(const std::string& uri) {
    const std::size_t slash = uri.rfind('/');
    return slash == std::string::npos ? std::string() : uri.substr(0, slash + 1);
  }
  /// A file beside a document: an open one, or from disk; null = there is none.
  std::optional<ProgramFileOfEditor> beside(const std::string& uri, const std::string& name) {
    const std::string folder = folder_of(uri);
    for (const auto& [other, d] : documents_)
      if (d.name == name && folder_of(other) == folder)
        return ProgramFileOfEditor{name, other, d.text};
    const auto path = path_of(uri);
    if (!path) return std::nullopt;
    const fs::path file = path->parent_path() / name;
    const std::string key = file.string();
    auto found = beside_.find(key);
    if (found == beside_.end()) {
      std::shared_ptr<const Text> text;
      if (file_kind(file) == FileKind::file) {
        auto bytes = io::read_file(file, kMostBeside);
        if (bytes.ok()) text = std::make_shared<const Text>(program::as_utf8(*bytes));
        else warn(bytes.error().sentence());
      }
      constexpr std::size_t kMostKept = 200;
      if (beside_.size() >= kMostKept) beside_.clear();
      found = beside_.emplace(key, std::move(text)).first;
    }
    if (!found->second) return std::nullopt;
    return ProgramFileOfEditor{name, uri_of(file), found->second};
  }
  /// The document and what it names, through other files too.
  std::vector<ProgramFileOfEditor> files_of(Document& d) {
    std::vector<ProgramFileOfEditor> out{{d.name, d.uri, d.text}};
    std::set<std::string> seen{d.name};
    const auto take = [&](const std::string& named, bool is_wanted) {
      const std::string base = fs::path(named).filename().string();
      if (base.empty() || base == "." || base == ".." || out.size() >= kMostFiles ||
          !seen.insert(base).second)
        return;
      auto file = beside(d.uri, base);
      if (file) out.push_back(std::move(*file));
      (void)is_wanted;
    };
    for (std::size_t i = 0; i < out.size() && i < kMostFiles; ++i) {
      std::vector<std::string> names;
      const auto open = documents_.find(out[i].uri);
      if (open != documents_.end()) {
        names = needs_of(open->second);
      } else {
        const auto p = language_of(out[i].name);
        if (p.ok()) {
          auto all = (*p)->language->needs(SourceFile{out[i].name, out[i].text->all(), {}});
          if (all.ok()) names = std::move(all).value();
        }
      }
      for (const std::string& n : names) take(n, true);
      if (i == 0) take("datalist.dls", false);
    }
    return out;
  }
  static bool has_extension_of(const Provider& p, const std::string& name) {
    const std::size_t dot = name.rfind('.');
    if (dot == std::string::npos) return true;
    std::string extension = name.substr(dot + 1);
    for (char& c : extension)
      if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
    for (const std::string_view e : text::split(p.language->extensions(), ','))
      if (e == extension) return true;
    return false;
  }
  /// The document whose program a document is looked at in: the first that names it, else itself.
  Document& root_of(Document& d) {
    Document* first = nullptr;
    for (auto& [uri, other] : documents_) {
      if (&other == &d || folder_of(uri) != folder_of(d.uri)) continue;
      if (first && first->order < other.order) continue;
      const auto p = language_of(other.name);
      if (!p.ok() || !has_extension_of(**p, other.name)) continue;
      bool names_it = false;
      // Those of a program that names nothing are not gone through.
      if (!needs_of(other).empty() || d.name == "datalist.dls")
        for (const ProgramFileOfEditor& f : files_of(other)) names_it = names_it || f.uri == d.uri;
      if (names_it) first = &other;
    }
    // Two modules that name each other are each looked at by itself.
    if (!first) return d;
    for (const ProgramFileOfEditor& f : files_of(d))
      if (f.uri == first->uri) return d;
    return *first;
  }
  Result<std::shared_ptr<const OpenProgram>> program_of(Document& root) {
    std::vector<ProgramFileOfEditor> files = files_of(root);
    for (const auto& p : programs_) {
      const bool is_same =
          p->files.size() == files.size() &&
          std::equal(files.begin(), files.end(), p->files.begin(),
                     [](const ProgramFileOfEditor& a, const ProgramFileOfEditor& b) {
                       return a.uri == b.uri && a.text == b.text;
                     });
      if (!is_same) continue;
      p->used = ++used_;
      return std::shared_ptr<const OpenProgram>(p);
    }
    RMP_TRY_ASSIGN(const Provider* language, language_of(root.name));
    std::vector<SourceFile> sources;
    for (const ProgramFileOfEditor& f : files) sources.push_back({f.name, f.text->all(), {}});
    auto made = std::make_shared<OpenProgram>();
    RMP_TRY_ASSIGN(made->program, program::open_editing(language->language, language->info.name,
                                                        language->params, sources));
    made->files = std::move(files);
    made->language = language->info.name;
    made->used = ++used_;
    // What was of an older text of the same document goes first, then what was not used for long.
    std::erase_if(programs_, [&](const auto& p) { return p->files[0].uri == root.uri; });
    if (programs_.size() >= kMostPrograms)
      programs_.erase(
          std::min_element(programs_.begin(), programs_.end(),
                           [](const auto& a, const auto& b) { return a->used < b->used; }));
    programs_.push_back(made);
    return std::shared_ptr<const OpenProgram>(std::move(made));
  }
  /// Of the document of a request.
  std::variant<Where, ServerFailure> where(const Json& params) {
    const std::string uri = string_member(member(params, "textDocument"), "uri");
    const auto found = documents_.find(uri);
    if (found == documents_.end())
      return ServerFailure{kEditorInvalidParams,
                           "the document " + text::quote(uri) + " is not open."};
    Document& root = root_of(found->second);
    auto program = program_of(root);
    if (!program.ok()) return failure(program.error());
    Where out;
    out.program = std::move(program).value();
    for (std::size_t i = 0; i < out.program->files.size(); ++i)
      if (out.program->files[i].uri == uri) out.file = static_cast<std::uint32_t>(i);
    return out;
  }
  std::optional<std::uint32_t> place(const Where& w, const Json& params) const {
    const Json& position = member(params, "position");
    const auto line = number_member(position, "line"),
               character = number_member(position, "character");
    if (!line || !character) return std::nullopt;
    return w.text().byte(*line, *character, units_);
  }
  static ServerFailure no_position() {
    return {kEditorInvalidParams, "the request has no position with line and character."};
  }
  Json location(const Where& w, const SourceRange& r) const {
    const ProgramFileOfEditor& f = w.program->files[r.file];
    return {{"uri", f.uri}, {"range", f.text->range(r.begin, r.end, units_)}};
  }

  // ---- answers ----

  /// Asks the program at the place of a request.
  template <class Ask, class Tell>
  Answer at_place(const Json& params, Ask&& ask, Tell&& tell) {
    auto found = where(params);
    if (found.index() == 1) return std::get<1>(found);
    const Where& w = std::get<0>(found);
    const auto byte = place(w, params);
    if (!byte) return no_position();
    Watched progress(*this, false);
    auto answer = ask(w, *byte, progress);
    if (!answer.ok()) return failure(answer.error());
    return tell(w, *byte, *answer);
  }

  static int item_kind(SourceTokenKind k) {
    switch (k) {
      case SourceTokenKind::keyword: return 14;
      case SourceTokenKind::constant: return 21;
      case SourceTokenKind::signal: return 23;
      case SourceTokenKind::type: return 22;
      case SourceTokenKind::field: return 5;
      case SourceTokenKind::procedure: return 2;
      case SourceTokenKind::function: return 3;
      case SourceTokenKind::process:
      case SourceTokenKind::robot: return 7;
      case SourceTokenKind::attribute: return 10;
      case SourceTokenKind::string: return 17;
      case SourceTokenKind::program: return 9;
      case SourceTokenKind::label: return 18;
      default: return 6;
    }
  }
  Answer completion(const Json& params) {
    is_hurried_ = true;
    Answer answer = completion_now(params);
    is_hurried_ = false;
    return answer;
  }
  Answer completion_now(const Json& params) {
    return at_place(
        params,
        [](const Where& w, std::uint32_t byte, Progress& p) {
          return w.program->program->complete(w.file, byte, p);
        },
        [this](const Where& w, std::uint32_t, std::vector<SourceCompletion>& all) -> Answer {
          Json items = Json::array();
          if (all.size() > kMostItems) all.resize(kMostItems);
          Json range;
          for (std::size_t i = 0; i < all.size(); ++i) {
            const SourceCompletion& c = all[i];
            if (i == 0 || c.begin != all[i - 1].begin || c.end != all[i - 1].end)
              range = w.text().range(c.begin, c.end, units_);
            std::string order = std::to_string(i);
            order.insert(0, 5 - std::min<std::size_t>(order.size(), 5), '0');
            items.push_back({{"label", c.label},
                             {"kind", item_kind(c.kind)},
                             {"sortText", order},
                             {"textEdit", {{"range", range}, {"newText", c.insert}}},
                             {"data", {{"list", items_number_ + 1}, {"item", i}}}});
          }
          ++items_number_;
          items_ = std::move(all);
          // What is typed next is asked for again.
          return Json{{"isIncomplete", true}, {"items", std::move(items)}};
        });
  }
  Answer resolve(const Json& item) {
    Json out = item.is_object() ? item : Json::object();
    const Json& data = member(item, "data");
    const auto list = number_member(data, "list"), n = number_member(data, "item");
    if (list && n && *list == items_number_ && *n < items_.size()) {
      const SourceCompletion& c = items_[*n];
      if (!c.detail.empty()) out["detail"] = c.detail;
      if (!c.doc.empty()) out["documentation"] = c.doc;
    }
    return out;
  }
  Answer hover(const Json& params) {
    return at_place(
        params,
        [](const Where& w, std::uint32_t byte, Progress& p) {
          return w.program->program->hover(w.file, byte, p);
        },
        [this](const Where& w, std::uint32_t, const SourceHover& h) -> Answer {
          if (h.detail.empty()) return Json();
          const std::string value = has_markdown_
                                        ? "```" + w.program->language + "\n" + h.detail + "\n```" +
                                              (h.doc.empty() ? "" : "\n\n" + escaped(h.doc))
                                        : h.detail + (h.doc.empty() ? "" : "\n\n" + h.doc);
          return Json{
              {"contents", {{"kind", has_markdown_ ? "markdown" : "plaintext"}, {"value", value}}},
              {"range", w.text().range(h.range.begin, h.range.end, units_)}};
        });
  }
  /// Signs of Markdown as they are.
  static std::string escaped(std::string_view s) {
    std::string out;
    for (const char c : s) {
      if (std::string_view("\\`*_{}[]<>#|!~").find(c) != std::string_view::npos) out += '\\';
      out += c;
    }
    return out;
  }
  Answer definition(const Json& params) {
    return at_place(
        params,
        [](const Where& w, std::uint32_t byte, Progress& p) {
          return w.program->program->definition(w.file, byte, p);
        },
        [this](const Where& w, std::uint32_t, const std::vector<SourceRange>& all) -> Answer {
          Json out = Json::array();
          for (const SourceRange& r : all) out.push_back(location(w, r));
          return out;
        });
  }
  Answer references(const Json& params) {
    const bool with_declaration = member(member(params, "context"), "includeDeclaration") != false;
    return at_place(
        params,
        [](const Where& w, std::uint32_t byte, Progress& p) {
          return w.program->program->references(w.file, byte, p);
        },
        [&](const Where& w, std::uint32_t, const std::vector<SourceReference>& all) -> Answer {
          Json out = Json::array();
          for (const SourceReference& r : all)
            if (with_declaration || !r.is_declaration) out.push_back(location(w, r.range));
          return out;
        });
  }
  Answer highlight(const Json& params) {
    return at_place(
        params,
        [](const Where& w, std::uint32_t byte, Progress& p) {
          return w.program->program->references(w.file, byte, p);
        },
        [this](const Where& w, std::uint32_t, const std::vector<SourceReference>& all) -> Answer {
          Json out = Json::array();
          for (const SourceReference& r : all)
            if (r.range.file == w.file)
              out.push_back({{"range", w.text().range(r.range.begin, r.range.end, units_)}});
          return out;
        });
  }
  Answer rename(const Json& params) {
    const std::string to = string_member(params, "newName");
    if (to.empty()) return ServerFailure{kEditorInvalidParams, "the new name is empty."};
    return at_place(
        params,
        [&](const Where& w, std::uint32_t byte, Progress& p) {
          return w.program->program->rename(w.file, byte, to, p);
        },
        [this](const Where& w, std::uint32_t, const std::vector<SourceEdit>& all) -> Answer {
          Json changes = Json::object();
          for (const SourceEdit& e : all) {
            const ProgramFileOfEditor& f = w.program->files[e.range.file];
            changes[f.uri].push_back({{"range", f.text->range(e.range.begin, e.range.end, units_)},
                                      {"newText", e.text}});
          }
          return Json{{"changes", std::move(changes)}};
        });
  }
  Answer prepare_rename(const Json& params) {
    return at_place(
        params,
        [](const Where& w, std::uint32_t byte, Progress& p) {
          return w.program->program->rename(w.file, byte, "", p);
        },
        [this](const Where& w, std::uint32_t, const std::vector<SourceEdit>& all) -> Answer {
          for (const SourceEdit& e : all)
            if (e.range.file == w.file)
              return Json{{"range", w.text().range(e.range.begin, e.range.end, units_)},
                          {"placeholder", e.text}};
          return Json();
        });
  }
  /// Of all, or of the lines of `range`: the blanks that change.
  Answer formatting(const Json& params) {
    auto found = where(params);
    if (found.index() == 1) return std::get<1>(found);
    const Where& w = std::get<0>(found);
    const Json& options = member(params, "options");
    SourceLayout layout;
    if (const auto n = number_member(options, "tabSize")) layout.indent = *n;
    const std::string words = string_member(options, "keywords");
    if (words == "upper") layout.words = SourceCase::upper;
    else if (words == "lower") layout.words = SourceCase::lower;
    else if (!words.empty() && words != "keep")
      return ServerFailure{kEditorInvalidParams, "keywords is \"keep\", \"upper\" or \"lower\"."};
    const std::string& old = w.text().all();
    std::uint32_t first = 0, last = static_cast<std::uint32_t>(old.size());
    if (const Json& range = member(params, "range"); !range.is_null()) {
      const auto a = number_member(member(range, "start"), "line"),
                 b = number_member(member(range, "end"), "line");
      if (!a || !b || *b < *a)
        return ServerFailure{kEditorInvalidParams, "the request has no range of lines."};
      first = w.text().byte(*a, 0, units_);
      last = w.text().byte(*b, 0xffffffffU, units_);
    }
    Watched progress(*this, false);
    const auto made = w.program->program->format(w.file, layout, progress);
    if (!made.ok()) return failure(made.error());
    Json edits = Json::array();
    const auto add = [&](std::size_t begin, std::size_t end, std::string_view with) {
      const auto b = static_cast<std::uint32_t>(begin), e = static_cast<std::uint32_t>(end);
      // Blanks before the first line of a range are its indentation and what is above.
      if (e < first || b > last) return;
      edits.push_back({{"range", w.text().range(b, e, units_)}, {"newText", with}});
    };
    const auto blank = [](char c) {
      return c == ' ' || c == '\t' || c == '\r' || c == '\n' || c == '\f';
    };
    const std::string& now = *made;
    std::size_t i = 0, j = 0;
    while (i < old.size() || j < now.size()) {
      std::size_t i1 = i, j1 = j;
      while (i1 < old.size() && blank(old[i1])) ++i1;
      while (j1 < now.size() && blank(now[j1])) ++j1;
      if (std::string_view(old).substr(i, i1 - i) != std::string_view(now).substr(j, j1 - j))
        add(i, i1, std::string_view(now).substr(j, j1 - j));
      i = i1;
      j = j1;
      if (i < old.size() && j < now.size()) {
        if (old[i] != now[j]) add(i, i + 1, std::string_view(now).substr(j, 1));
        ++i;
        ++j;
      } else if (i < old.size() || j < now.size()) {
        return ServerFailure{
            kFailed, "formatting would change more than blanks, so the text stays unchanged."};
      }
    }
    return edits;
  }
  static int symbol_kind(SourceTokenKind k) {
    switch (k) {
      case SourceTokenKind::constant: return 14;
      case SourceTokenKind::signal: return 24;
      case SourceTokenKind::type: return 23;
      case SourceTokenKind::field: return 8;
      case SourceTokenKind::procedure:
      case SourceTokenKind::function: return 12;
      case SourceTokenKind::process:
      case SourceTokenKind::robot: return 19;
      case SourceTokenKind::program: return 2;
      default: return 13;
    }
  }
  Answer symbols(const Json& params) {
    auto found = where(params);
    if (found.index() == 1) return std::get<1>(found);
    const Where& w = std::get<0>(found);
    Watched progress(*this, false);
    const auto all = w.program->program->outline(w.file, progress);
    if (!all.ok()) return failure(all.error());
    std::vector<Json> rows;
    for (const SourceSymbol& s : *all) {
      Json one{{"name", s.name.empty() ? "?" : s.name}, {"kind", symbol_kind(s.kind)}};
      if (has_tree_) {
        one["detail"] = s.detail;
        one["range"] = w.text().range(s.begin, s.end, units_);
        one["selectionRange"] = w.text().range(s.name_begin, s.name_end, units_);
      } else {
        one["location"] = location(w, {w.file, s.begin, s.end});
      }
      rows.push_back(std::move(one));
    }
    Json out = Json::array();
    if (!has_tree_) {
      for (Json& r : rows) out.push_back(std::move(r));
      return out;
    }
    // From the end, so that each is whole when it is put into another.
    for (std::size_t i = rows.size(); i-- > 0;) {
      const std::uint32_t parent = (*all)[i].parent;
      if (rows[i].contains("children"))
        std::reverse(rows[i]["children"].begin(), rows[i]["children"].end());
      (parent == RMP_NONE ? out : rows[parent]["children"]).push_back(std::move(rows[i]));
    }
    std::reverse(out.begin(), out.end());
    return out;
  }
  static std::uint32_t token_type(SourceTokenKind k) {
    switch (k) {
      case SourceTokenKind::keyword: return 0;
      case SourceTokenKind::number: return 1;
      case SourceTokenKind::string: return 2;
      case SourceTokenKind::comment: return 3;
      case SourceTokenKind::parameter: return 6;
      case SourceTokenKind::type: return 7;
      case SourceTokenKind::field:
      case SourceTokenKind::attribute: return 8;
      case SourceTokenKind::procedure:
      case SourceTokenKind::function: return 9;
      case SourceTokenKind::signal: return 10;
      case SourceTokenKind::label: return 11;
      case SourceTokenKind::program: return 12;
      case SourceTokenKind::process:
      case SourceTokenKind::robot: return 13;
      default: return 5;
    }
  }
  Answer tokens(const Json& params) {
    auto found = where(params);
    if (found.index() == 1) return std::get<1>(found);
    const Where& w = std::get<0>(found);
    Watched progress(*this, false);
    const auto all = w.program->program->tokens(w.file, progress);
    if (!all.ok()) return failure(all.error());
    std::vector<std::uint32_t> data;
    std::uint32_t last_line = 0, last_start = 0;
    const Text& text = w.text();
    for (const SourceToken& t : *all) {
      if (t.kind == SourceTokenKind::sign || t.kind == SourceTokenKind::name ||
          t.kind == SourceTokenKind::unknown)
        continue;
      const std::uint32_t from = text.line_of(t.begin);
      const std::uint32_t to = t.end > t.begin ? text.line_of(t.end - 1) : from;
      // A comment of several lines is one each.
      for (std::uint32_t line = from; line <= to; ++line) {
        const std::uint32_t begin = line == from ? t.begin : text.line_begin(line);
        const std::uint32_t end = line == to ? t.end : text.line_end(line);
        if (end <= begin) continue;
        const std::uint32_t start = text.units(text.line_begin(line), begin, units_);
        data.push_back(line - last_line);
        data.push_back(line == last_line ? start - last_start : start);
        data.push_back(text.units(begin, end, units_));
        data.push_back(token_type(t.kind));
        data.push_back((t.is_declaration ? 1U : 0U) |
                       (t.kind == SourceTokenKind::constant ? 2U : 0U) |
                       (t.is_predefined ? 4U : 0U));
        last_line = line;
        last_start = start;
      }
    }
    return Json{{"data", std::move(data)}};
  }
  Answer signature(const Json& params) {
    return at_place(
        params,
        [](const Where& w, std::uint32_t byte, Progress& p) {
          return w.program->program->signature(w.file, byte, p);
        },
        [this](const Where&, std::uint32_t, const SourceSignature& s) -> Answer {
          if (s.label.empty()) return Json();
          const Text label{s.label};
          Json parameters = Json::array();
          for (std::size_t i = 0; i + 1 < s.parameters.size(); i += 2)
            parameters.push_back({{"label",
                                   {label.units(0, s.parameters[i], Units::utf16),
                                    label.units(0, s.parameters[i + 1], Units::utf16)}}});
          Json one{{"label", s.label}, {"parameters", std::move(parameters)}};
          if (!s.doc.empty()) one["documentation"] = s.doc;
          return Json{{"signatures", {std::move(one)}},
                      {"activeSignature", 0},
                      {"activeParameter", s.active}};
        });
  }
  Answer folds(const Json& params) {
    auto found = where(params);
    if (found.index() == 1) return std::get<1>(found);
    const Where& w = std::get<0>(found);
    Watched progress(*this, false);
    const auto all = w.program->program->folds(w.file, progress);
    if (!all.ok()) return failure(all.error());
    Json out = Json::array();
    for (const SourceRange& r : *all) {
      const std::uint32_t first = w.text().line_of(r.begin),
                          last = w.text().line_of(r.end > r.begin ? r.end - 1 : r.end);
      if (last <= first) continue;
      Json one{{"startLine", first}, {"endLine", last}};
      if (w.text().all()[r.begin] == '{') one["kind"] = "comment";
      out.push_back(std::move(one));
    }
    return out;
  }

  // ---- faults ----

  /// Of one document that is due; put off where something else comes.
  void tell_faults() {
    Document* due = nullptr;
    for (auto& [uri, d] : documents_)
      if (d.is_due && (!due || d.order > due->order)) due = &d;
    if (!due) return;
    Document& d = *due;
    d.is_due = false;
    Json all = Json::array();
    const auto note = [&](const std::string& message, int severity) {
      all.push_back({{"range", d.text->range(0, 0, units_)},
                     {"severity", severity},
                     {"source", "robomosp"},
                     {"message", message}});
    };
    constexpr int kError = 1, kInformation = 3;
    Document& root = root_of(d);
    // What has not changed is not told again.
    std::vector<std::pair<std::string, std::shared_ptr<const Text>>> of;
    for (ProgramFileOfEditor& f : files_of(root)) of.emplace_back(f.uri, std::move(f.text));
    if (of == d.told && d.version == d.told_version) return;
    const auto language = language_of(d.name);
    if (!language.ok()) {
      note(language.error().sentence(), kError);
    } else if (&root == &d && !has_extension_of(**language, d.name) && d.name.size() > 4 &&
               d.name.substr(d.name.size() - 4) == ".dls") {
      note("A data list is checked with its program. Open the program too.", kInformation);
    } else {
      const auto program = program_of(root);
      if (!program.ok()) {
        note(program.error().sentence(), kError);
      } else {
        Watched progress(*this, true);
        const auto faults = (*program)->program->faults(progress);
        if (!faults.ok() && faults.error().code == ErrorCode::cancelled) {
          d.is_due = documents_.contains(d.uri);
          return;
        }
        if (!faults.ok()) note(faults.error().sentence(), kError);
        for (std::size_t i = 0; faults.ok() && i < faults->size(); ++i) {
          const SourceFault& f = (*faults)[i];
          const ProgramFileOfEditor& file = (*program)->files[f.range.file];
          if (file.uri != d.uri) continue;
          all.push_back({{"range", file.text->range(f.range.begin, f.range.end, units_)},
                         {"severity", f.severity + 1},
                         {"source", (*program)->language},
                         {"message", f.message + "." + (f.hint.empty() ? "" : "\n" + f.hint)}});
        }
      }
    }
    d.told = std::move(of);
    d.told_version = d.version;
    notify("textDocument/publishDiagnostics",
           {{"uri", d.uri}, {"version", d.version}, {"diagnostics", std::move(all)}});
  }

  ioci::Application& app_;
  const int in_, out_;
  Frames frames_;
  std::deque<Waiting> waiting_;
  std::size_t waiting_bytes_ = 0;
  Json current_;
  bool is_current_cancelled_ = false;
  bool has_read_ = false;  ///< the last time that it looked
  bool is_quiet_ = false;  ///< nothing has come for a while
  bool is_readable_ = true, is_broken_ = false, is_over_ = false;
  bool is_initialized_ = false, is_shut_down_ = false;
  Units units_ = Units::utf16;
  bool is_hurried_ = false;  ///< while a completion is looked for
  bool has_markdown_ = false, has_tree_ = false;
  std::map<std::string, Document> documents_;
  std::uint64_t opened_ = 0, used_ = 0;
  std::vector<Provider> providers_;
  std::map<std::string, std::shared_ptr<const Text>> beside_;  ///< null = there is none
  std::vector<std::shared_ptr<OpenProgram>> programs_;
  std::vector<SourceCompletion> items_;  ///< of the last completion
  std::uint32_t items_number_ = 0;
};

}  // namespace

int serve_editor(ioci::Application& app, int in, int out) {
  return EditorServer(app, in, out).run();
}

}  // namespace robomosp::remote
