// SPDX-License-Identifier: Apache-2.0
// What reaches out of the program in Lua's own libraries, for scripts of a session whose files lie
// in a folder: files through the door (kernel/file_root.h), programs and machine code not at all
// (layer: application, lua, internal).
#include <cerrno>
#include <cstring>
#include <optional>

#include "kernel/effects.h"
#include "kernel/file_root.h"
#include "kernel/text.h"
#include "lua/internal.h"
#include "lua/program_state.h"

#include <fcntl.h>

namespace robomosp::lua {
namespace {

namespace fs = std::filesystem;

constexpr std::uint64_t kMostCode = std::uint64_t{64} << 20;  // [bytes]

/// Where the arguments begin: 1 is the function of Lua's, 2 its name.
constexpr int kFirst = 3;

std::string text_at(lua_State* L, int index) {
  std::size_t size = 0;
  const char* s = luaL_checklstring(L, index, &size);
  return {s, size};
}

/// nil, a message and a number, as Lua's own functions answer.
int nothing(lua_State* L, const Error& e) {
  lua_pushnil(L);
  lua_pushlstring(L, e.message.data(), e.message.size());
  lua_pushinteger(L, e.code == ErrorCode::not_found ? ENOENT : EIO);
  return 3;
}

Error refused(const std::string& what, const char* hint) {
  return error(ErrorCode::permission, what + " in a session confined to a folder", hint);
}

/// Flags of open(2) for a mode of fopen(); nullopt for another text.
std::optional<int> flags_of(std::string_view mode) {
  if (mode.empty()) return std::nullopt;
  const char kind = mode.front();
  mode.remove_prefix(1);
  const bool is_both = mode.starts_with('+');
  if (is_both) mode.remove_prefix(1);
  if (!mode.empty() && mode != "b") return std::nullopt;
  const int access = is_both ? O_RDWR : kind == 'r' ? O_RDONLY : O_WRONLY;
  if (kind == 'r') return access;
  if (kind == 'w') return access | O_CREAT | O_TRUNC;
  if (kind == 'a') return access | O_CREAT | O_APPEND;
  return std::nullopt;
}

/// Lua's own function with the opened file in place of its name; the arguments stand from kFirst.
int with_file(lua_State* L, const FileDescriptor& fd) {
  const std::string name = "/proc/self/fd/" + std::to_string(fd.get());
  const int count = lua_gettop(L);
  lua_pushlstring(L, name.data(), name.size());
  lua_replace(L, kFirst);
  luaL_checkstack(L, count + 1, "too many arguments");
  lua_pushvalue(L, 1);
  for (int i = kFirst; i <= count; ++i) lua_pushvalue(L, i);
  lua_call(L, count - kFirst + 1, LUA_MULTRET);
  return lua_gettop(L) - count;
}

Result<int> open_file(lua_State* L) {
  const std::string path = text_at(L, kFirst);
  const std::string mode = lua_isnoneornil(L, kFirst + 1) ? "r" : text_at(L, kFirst + 1);
  const auto flags = flags_of(mode);
  if (!flags)
    return error(ErrorCode::invalid_argument, text::quote(mode) + " is not a file mode",
                 "Modes are r, w, a, r+, w+ and a+, optionally followed by b.");
  auto fd = *flags == O_RDONLY ? open_to_read(path) : open_to_write(path, *flags);
  if (fd.ok()) return with_file(L, *fd);
  if (fd.error().code == ErrorCode::permission) return std::move(fd).error();
  return nothing(L, fd.error());
}

/// Pushes the function of a file; false with a message pushed where it is faulty.
Result<bool> load_file(Impl& impl, lua_State* L, const std::string& path) {
  RMP_TRY_ASSIGN(std::string code, read_permitted(path, kMostCode));
  if (code.starts_with("#")) code.erase(0, code.find('\n'));  // as Lua leaves out a first line
  const std::string chunk = "@" + path;
  impl.sources[chunk] = code;
  return luaL_loadbufferx(L, code.data(), code.size(), chunk.c_str(), "t") == LUA_OK;
}

Result<int> load_function(Impl& impl, lua_State* L) {
  const std::string path = text_at(L, kFirst);
  const bool has_environment = !lua_isnone(L, kFirst + 2);
  const auto loaded = load_file(impl, L, path);
  if (!loaded.ok()) {
    if (loaded.error().code == ErrorCode::permission) return loaded.error();
    return nothing(L, loaded.error());
  }
  if (!*loaded) {
    lua_pushnil(L);
    lua_insert(L, -2);
    return 2;
  }
  if (has_environment) {
    lua_pushvalue(L, kFirst + 2);
    if (!lua_setupvalue(L, -2, 1)) lua_pop(L, 1);
  }
  return 1;
}

Result<int> do_file(Impl& impl, lua_State* L) {
  if (lua_isnoneornil(L, kFirst))
    return refused("dofile needs the name of a file", "Write dofile(\"name.lua\").");
  RMP_TRY_ASSIGN(const bool is_loaded, load_file(impl, L, text_at(L, kFirst)));
  if (is_loaded) return 1;
  return to_error(L, -1);
}

/// The first file of a path of templates "./?.lua;..."; "" and what was tried.
std::string first_file(const std::string& name, const std::string& templates,
                       const std::string& separator, const std::string& replaced,
                       std::string& tried) {
  std::string in_path = name;
  if (!separator.empty())
    for (std::size_t at = 0; (at = in_path.find(separator, at)) != std::string::npos;
         at += replaced.size())
      in_path.replace(at, separator.size(), replaced);
  for (const std::string_view each : text::split(templates, ';')) {
    if (each.empty()) continue;
    std::string file(each);
    for (std::size_t at = 0; (at = file.find('?', at)) != std::string::npos; at += in_path.size())
      file.replace(at, 1, in_path);
    if (file_kind(file) == FileKind::file) return file;
    tried += "\n\tno file '" + file + "'";
  }
  return {};
}

Result<int> search_path(lua_State* L) {
  const std::string name = text_at(L, kFirst), templates = text_at(L, kFirst + 1);
  const std::string separator = lua_isnoneornil(L, kFirst + 2) ? "." : text_at(L, kFirst + 2);
  const std::string replaced = lua_isnoneornil(L, kFirst + 3) ? "/" : text_at(L, kFirst + 3);
  std::string tried;
  const std::string file = first_file(name, templates, separator, replaced, tried);
  if (!file.empty()) {
    lua_pushlstring(L, file.data(), file.size());
    return 1;
  }
  lua_pushnil(L);
  lua_pushlstring(L, tried.data(), tried.size());
  return 2;
}

/// The second searcher of require().
Result<int> find_module(Impl& impl, lua_State* L) {
  const std::string name = text_at(L, kFirst);
  lua_getglobal(L, "package");
  lua_getfield(L, -1, "path");
  const std::string templates = lua_type(L, -1) == LUA_TSTRING ? lua_tostring(L, -1) : "";
  std::string tried;
  const std::string file = first_file(name, templates, ".", "/", tried);
  if (file.empty()) {
    lua_pushlstring(L, tried.data(), tried.size());
    return 1;
  }
  RMP_TRY_ASSIGN(const bool is_loaded, load_file(impl, L, file));
  if (!is_loaded) return to_error(L, -1);
  lua_pushlstring(L, file.data(), file.size());
  return 2;
}

Result<int> call_confined(Impl& impl, lua_State* L) {
  const std::string name = text_at(L, 2);
  const SessionFiles files(impl);
  if (name == "io.popen" || name == "os.execute")
    return refused(name + " does not start programs",
                   "Use commands, which declare the programs they start.");
  if (name == "io.tmpfile" || name == "os.tmpname")
    return refused(name + " does not make temporary files",
                   "Open a file of the folder, and remove it afterwards.");
  if (name == "machine code") {
    lua_pushliteral(L, "\n\tno machine code in a session confined to a folder");
    return 1;
  }
  if (name == "require") return find_module(impl, L);
  if (name == "package.searchpath") return search_path(L);
  if (name == "loadfile") {
    if (lua_isnoneornil(L, kFirst))
      return refused("loadfile needs the name of a file", "Write loadfile(\"name.lua\").");
    return load_function(impl, L);
  }
  if (name == "dofile") return do_file(impl, L);
  if (name == "io.open") return open_file(L);
  if (name == "os.remove") {
    const auto removed = remove_file(text_at(L, kFirst));
    if (!removed.ok() && removed.error().code == ErrorCode::permission) return removed.error();
    if (!removed.ok()) return nothing(L, removed.error());
    if (!*removed)
      return nothing(L, error(ErrorCode::not_found, text_at(L, kFirst) + ": no such file"));
    lua_pushboolean(L, 1);
    return 1;
  }
  if (name == "os.rename") {
    const auto renamed = rename_file(text_at(L, kFirst), text_at(L, kFirst + 1));
    if (!renamed.ok() && renamed.error().code == ErrorCode::permission) return renamed.error();
    if (!renamed.ok()) return nothing(L, renamed.error());
    lua_pushboolean(L, 1);
    return 1;
  }
  if (name == "io.lines" || name == "io.input" || name == "io.output") {
    const std::string path = text_at(L, kFirst);
    auto fd = name == "io.output" ? open_to_write(path, O_WRONLY | O_CREAT | O_TRUNC)
                                  : open_to_read(path);
    if (!fd.ok()) return std::move(fd).error();
    return with_file(L, *fd);
  }
  return refused(name + " is not available", "Use commands.");
}

int rest(lua_State* L, int, lua_KContext) { return lua_gettop(L); }

}  // namespace

SessionFiles::SessionFiles(const Impl& impl)
    : permit_{program_of(impl).session.name(),   "a script", Effects::all(),
              program_of(impl).session.denied(), false,      false,
              program_of(impl).session.files()},
      scope_(program_of(impl).session.files() ? &permit_ : current_permit()) {}

int call_confined_library(lua_State* L) {
  const bool is_dofile = std::strcmp(lua_tostring(L, 2), "dofile") == 0;
  const int results = enter(L, call_confined);
  if (!is_dofile) return results;
  lua_replace(L, 1);
  lua_settop(L, 1);
  lua_callk(L, 0, LUA_MULTRET, 0, rest);
  return lua_gettop(L);
}

}  // namespace robomosp::lua
