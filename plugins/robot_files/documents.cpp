// SPDX-License-Identifier: Apache-2.0
#include "documents.h"

#include <tinyxml2.h>

#include <algorithm>
#include <utility>

#include <robomosp/sdk/utf8_text.h>

#include "files.h"
#include "reach.h"

namespace robomosp::robot_files {
namespace {

/// Elements of these formats have some twenty; the longest lists are in values.
constexpr std::size_t kMostAttributes = 1000;

constexpr std::size_t kMostDocuments = 1000;
constexpr std::uintmax_t kMostBytes = std::uintmax_t{256} << 20;

const char* reason(tinyxml2::XMLError e) {
  switch (e) {
    case tinyxml2::XML_ERROR_MISMATCHED_ELEMENT: return "a closing tag has no open element";
    case tinyxml2::XML_ERROR_PARSING_ATTRIBUTE: return "an attribute is damaged";
    case tinyxml2::XML_ERROR_PARSING_ELEMENT: return "an element is damaged";
    case tinyxml2::XML_ERROR_PARSING_TEXT: return "a text is damaged";
    case tinyxml2::XML_ERROR_PARSING_COMMENT: return "a comment does not end";
    case tinyxml2::XML_ERROR_PARSING_CDATA: return "a CDATA section does not end";
    case tinyxml2::XML_ERROR_PARSING_DECLARATION: return "a declaration <?...?> is damaged";
    case tinyxml2::XML_ERROR_PARSING_UNKNOWN: return "a part <!...> does not end";
    case tinyxml2::XML_ERROR_EMPTY_DOCUMENT: return "it is empty";
    default: return "it ends too early or is damaged";
  }
}

/// Line of the first element with more attributes than `most`; 0 = none has. Looking for doubled
/// attributes takes tinyxml2 time by the square of their number, which no one can stop.
std::size_t line_of_too_many(std::string_view text, std::size_t most) {
  std::size_t line = 1;
  for (std::size_t i = 0; i < text.size();) {
    const auto skip_past = [&](std::string_view end) {
      const std::size_t at = text.find(end, i);
      const std::size_t to = at == std::string_view::npos ? text.size() : at + end.size();
      line += static_cast<std::size_t>(std::count(text.begin() + static_cast<std::ptrdiff_t>(i),
                                                  text.begin() + static_cast<std::ptrdiff_t>(to),
                                                  '\n'));
      i = to;
    };
    const std::string_view rest = text.substr(i);
    if (rest.starts_with("<!--")) {
      skip_past("-->");
    } else if (rest.starts_with("<![CDATA[")) {
      skip_past("]]>");
    } else if (rest.front() != '<') {
      if (rest.front() == '\n') ++line;
      ++i;
    } else {
      const std::size_t begins = line;
      std::size_t count = 0;
      for (++i; i < text.size() && text[i] != '>';) {
        const char c = text[i++];
        if (c == '\n') ++line;
        if (c != '"' && c != '\'') continue;
        if (++count > most) return begins;
        skip_past(std::string_view(&c, 1));
      }
    }
  }
  return 0;
}

}  // namespace

struct Documents::One {
  tinyxml2::XMLDocument document{true, tinyxml2::PRESERVE_WHITESPACE};
  Source source;
};

Documents::Documents(std::shared_ptr<Reach> reach) : reach_(std::move(reach)) {}
Documents::~Documents() = default;

const Source* source_of(const Element& e) {
  return static_cast<const Source*>(e.GetDocument()->GetUserData());
}

Result<const Element*> Documents::parse(std::string_view text, const std::filesystem::path& path) {
  return add(text, {"", path, nullptr});
}

Result<const Element*> Documents::add(std::string_view bytes, Source source) {
  const std::string text = utf8_text(bytes).text;
  auto one = std::make_unique<One>();
  one->source = std::move(source);
  tinyxml2::XMLDocument& d = one->document;
  d.SetUserData(&one->source);
  const std::string file =
      one->source.name.empty() ? "" : "file " + in_quotes(one->source.name) + ", ";
  if (const std::size_t line = line_of_too_many(text, kMostAttributes); line > 0)
    return error(ErrorCode::unsupported,
                 "an element has more than " + std::to_string(kMostAttributes) + " attributes",
                 "Check the file in the program it comes from.",
                 file + "line " + std::to_string(line));
  if (d.Parse(text.data(), text.size()) != tinyxml2::XML_SUCCESS) {
    const std::string where = file + "line " + std::to_string(d.ErrorLineNum());
    if (d.ErrorID() == tinyxml2::XML_ELEMENT_DEPTH_EXCEEDED)
      return error(ErrorCode::unsupported, "its elements are nested deeper than 100",
                   "URDF describes chains of any length without nesting.", where);
    return error(ErrorCode::syntax,
                 std::string("it is not well-formed XML: ") + reason(d.ErrorID()),
                 "Check it in the program it comes from.", where);
  }
  if (!d.RootElement())
    return error(ErrorCode::syntax, "it contains no element", "Give a robot's file.",
                 file + "line 1");
  all_.push_back(std::move(one));
  return all_.back()->document.RootElement();
}

Result<const Element*> Documents::open(const Element& asked, const std::filesystem::path& file) {
  namespace fs = std::filesystem;
  std::error_code failed;
  if (!reach_->allows(file))
    return fault(asked,
                 "file " + in_quotes(file.lexically_normal().string()) +
                     " lies outside the package " + in_quotes(reach_->package().string()),
                 "Give options = {outside = true} to read such files.");
  if (!files::is_file(file))
    return fault(asked, "there is no file " + in_quotes(file.string()),
                 "Put it beside the robot's file.");
  for (const Source* s = source_of(asked); s; s = s->asked)
    if (!s->path.empty() && fs::equivalent(s->path, file, failed))
      return fault(asked, "file " + in_quotes(file.filename().string()) + " includes itself",
                   "Remove one of the includes.");
  if (all_.size() >= kMostDocuments)
    return fault(asked, "there are more than 1000 included files", "Join them.");
  const auto text = files::read(file, kMostBytes - bytes_);
  if (!text.ok())
    return fault(asked, "the included files have more than 256 MiB",
                 "Store meshes in separate files.");
  bytes_ += text->size();
  return add(*text, {file.filename().string(), file, source_of(asked)});
}

}  // namespace robomosp::robot_files
