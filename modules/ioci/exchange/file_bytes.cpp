// SPDX-License-Identifier: Apache-2.0
// Bytes of files, for programs at the other end of a connection: read, written, listed, removed.
#include "io/native.h"
#include "ioci/core/commands.h"
#include "kernel/base64.h"
#include "kernel/file_root.h"
#include "kernel/permit.h"

namespace robomosp::ioci {
namespace {

constexpr std::int64_t kMostBytes = std::int64_t{16} << 20;  ///< of one call
constexpr std::int64_t kUsualBytes = std::int64_t{1} << 20;
constexpr std::size_t kMostListed = 100'000;
constexpr double kFarthest = 9007199254740992.0;  ///< 2^53, up to which reals are whole numbers

/// Only files have bytes that end; what waits for another program is not even opened.
Result<void> check_is_file(const std::string& file) {
  const FileKind kind = file_kind(file);
  if (kind == FileKind::file) return {};
  // Says why nothing may be known of it.
  RMP_TRY(permitted_path(file, Effect::files_read));
  if (kind == FileKind::none)
    return error(ErrorCode::not_found, "there is no file " + text::quote(file), "Check the path.");
  return error(ErrorCode::io,
               text::quote(file) + (kind == FileKind::folder ? " is a folder, not a file"
                                                             : " is not a regular file"));
}

Result<Value> read(CommandContext&, const Map& args) {
  RMP_TRY(require(Effect::files_read));
  const std::string file = text_of(args, "file");
  const auto offset = static_cast<std::uint64_t>(integer(args, "offset"));
  const auto length = static_cast<std::size_t>(integer(args, "length"));
  RMP_TRY(check_is_file(file));
  RMP_TRY_ASSIGN(const FilePart part, read_part(file, offset, length));
  std::string coded;
  base64::append(coded, part.bytes);
  return Value(Map{{"base64", std::move(coded)},
                   {"size", static_cast<std::int64_t>(part.size)},
                   {"is_end", offset + part.bytes.size() >= part.size}});
}

Result<std::string> decoded(const Map& args) {
  const std::string* coded = args.find("base64")->as_string();
  const auto size = base64::decoded_size(*coded);
  const auto fault = [](std::string message, std::string hint) {
    return error(ErrorCode::invalid_argument, std::move(message), std::move(hint), "base64");
  };
  if (size && *size > static_cast<std::size_t>(kMostBytes))
    return fault("there are " + std::to_string(*size) + " bytes; at most " +
                     std::to_string(kMostBytes) + " are written at once",
                 "Write the first bytes, then the others with append = true.");
  std::string bytes(size.value_or(0), '\0');
  if (!size || !base64::decode(*coded, bytes.data()))
    return fault("this is not base64", "Give the bytes in the standard alphabet with padding.");
  return bytes;
}

Result<Value> write(CommandContext&, const Map& args) {
  RMP_TRY(require(Effect::files_write));
  const std::string file = text_of(args, "file");
  RMP_TRY_ASSIGN(const std::string bytes, decoded(args));
  if (!flag(args, "append")) {
    RMP_TRY(io::write_file(file, bytes));
    return Value(static_cast<std::int64_t>(bytes.size()));
  }
  if (file_kind(file) != FileKind::none) RMP_TRY(check_is_file(file));
  RMP_TRY_ASSIGN(const std::uint64_t size, append_to(file, bytes));
  return Value(static_cast<std::int64_t>(size));
}

Result<Value> list(CommandContext&, const Map& args) {
  RMP_TRY(require(Effect::files_read));
  RMP_TRY_ASSIGN(const auto entries, list_folder(text_of(args, "folder"), kMostListed));
  List out;
  for (const FolderEntry& e : entries) {
    const char* kind = e.kind == FileKind::file     ? "file"
                       : e.kind == FileKind::folder ? "folder"
                                                    : "other";
    Map row{{"name", e.name}, {"kind", kind}};
    if (e.kind == FileKind::file) row.set("size", static_cast<std::int64_t>(e.size));
    out.emplace_back(std::move(row));
  }
  return Value(std::move(out));
}

Result<Value> remove(CommandContext&, const Map& args) {
  RMP_TRY(require(Effect::files_write));
  const std::string file = text_of(args, "file");
  RMP_TRY_ASSIGN(const bool was_there, remove_file(file));
  if (!was_there)
    return error(ErrorCode::not_found, "there is no file " + text::quote(file), "Check the path.");
  return Value();
}

}  // namespace

RMP_COMMANDS(file_byte_commands) {
  std::vector<CommandSpec> all;
  ParamSpec offset = defaulted("offset", "int", "", 0, "First byte to read.");
  offset.min = 0;
  offset.max = kFarthest;
  ParamSpec length =
      defaulted("length", "int", "", kUsualBytes, "Greatest number of bytes to read.");
  length.min = 1;
  length.max = static_cast<double>(kMostBytes);
  all.push_back(
      {.name = "file.read",
       .classic = "",
       .summary = "Reads bytes of a file.",
       .details = "For connected programs: fetches a picture or an export from the server's disk, "
                  "piece by piece. file.load reads files of records.",
       .example = "file.write{file = \"a.bin\", base64 = \"AAEC/w==\"}\n"
                  "local a = file.read{file = \"a.bin\", offset = 1}\n"
                  "assert(a.base64 == \"AQL/\" and a.size == 4 and a.is_end)",
       .params = {needed("file", "path", "", "The file."), offset, length},
       .returns = {"map",
                   "",
                   "",
                   {field("base64", "string", "", "The bytes, in base64 (RFC 4648)."),
                    field("size", "int", "", "Size of the whole file [bytes]."),
                    field("is_end", "bool", "", "Whether these are the last bytes of the file.")}},
       .effect = Effect::files_read,
       .run = read});
  all.push_back(
      {.name = "file.write",
       .classic = "",
       .summary = "Writes bytes to a file.",
       .details = "The file is replaced as a whole or not at all. With append the bytes are added "
                  "at its end, and a missing file is created. At most 16 MiB are written at once.",
       .example = "file.write{file = \"a.bin\", base64 = \"AAE=\"}\n"
                  "assert(file.write{file = \"a.bin\", base64 = \"Av8=\", append = true} == 4)",
       .params = {needed("file", "path", "", "The file."),
                  needed("base64", "string", "", "The bytes, in base64 (RFC 4648)."),
                  defaulted("append", "bool", "", false, "Append the bytes to the file.")},
       .returns = {"int", "", "Size of the file [bytes].", {}},
       .effect = Effect::files_write,
       .run = write});
  all.push_back(
      {.name = "file.list",
       .classic = "",
       .summary = "Lists the contents of a folder.",
       .details = "Sorted by name. A link is listed as its target, or as other if the target must "
                  "not be revealed. At most 100,000 names.",
       .example = "file.write{file = \"a.bin\", base64 = \"AAE=\"}\n"
                  "for _, f in ipairs(file.list()) do\n"
                  "  if f.name == \"a.bin\" then assert(f.kind == \"file\" and f.size == 2) end\n"
                  "end",
       .params = {defaulted("folder", "path", "", ".", "The folder.")},
       .returns = {"list",
                   "",
                   "",
                   {field("name", "string", "", "Name without the folder."),
                    field("kind", "string", "", "file, folder or other."),
                    field("size", "int", "", "Size of a file [bytes].")}},
       .effect = Effect::files_read,
       .run = list});
  all.push_back({.name = "file.remove",
                 .classic = "",
                 .summary = "Removes a file or an empty folder.",
                 .details = "A link itself is removed, not its target. Records loaded from the "
                            "file stay in the document.",
                 .example = "file.write{file = \"a.bin\", base64 = \"AAE=\"}\n"
                            "file.remove(\"a.bin\")",
                 .params = {needed("file", "path", "", "The file.")},
                 .returns = {},
                 .effect = Effect::files_write,
                 .run = remove});
  return all;
}

}  // namespace robomosp::ioci
