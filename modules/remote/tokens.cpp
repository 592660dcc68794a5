// SPDX-License-Identifier: Apache-2.0
#include "remote/tokens.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstdlib>
#include <cstring>

#include "kernel/text.h"
#include "remote/crypto.h"
#include "remote/json.h"

namespace robomosp::remote {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kLongestName = 64;
constexpr std::size_t kLargestFile = std::size_t{16} << 20;
constexpr std::uint64_t kHighestRate = 10'000'000;

std::int64_t now() {
  return std::chrono::duration_cast<std::chrono::seconds>(
             std::chrono::system_clock::now().time_since_epoch())
      .count();
}

class File {
 public:
  File(const fs::path& path, int flags)
      : fd_(::open(path.c_str(), flags | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK, 0600)) {}
  ~File() {
    if (fd_ >= 0) ::close(fd_);
  }
  File(const File&) = delete;
  File& operator=(const File&) = delete;
  [[nodiscard]] int fd() const { return fd_; }

 private:
  int fd_;
};

Error cannot(const fs::path& file, const char* what) {
  return error(errno == EACCES || errno == EPERM ? ErrorCode::permission : ErrorCode::io,
               "the file of the tokens " + text::quote(file.string()) + " cannot be " + what +
                   ": " + std::strerror(errno));
}

/// ErrorCode::permission when others than the owner may read or write what is open.
Result<void> check_mode(int fd, const fs::path& file) {
  struct stat info {};
  if (::fstat(fd, &info) != 0) return cannot(file, "read");
  if (!S_ISREG(info.st_mode))
    return error(ErrorCode::invalid_argument,
                 "the file of the tokens " + text::quote(file.string()) + " is not a regular file");
  if (info.st_uid != ::geteuid() && ::geteuid() != 0)
    return error(ErrorCode::permission, "the file of the tokens " + text::quote(file.string()) +
                                            " belongs to another user");
  if ((info.st_mode & (S_IRWXG | S_IRWXO)) != 0)
    return error(ErrorCode::permission,
                 "the file of the tokens " + text::quote(file.string()) +
                     " can be read or written by others than its owner",
                 "Do: chmod 600 " + file.string());
  return {};
}

Error damaged(const fs::path& file, std::string why) {
  return error(ErrorCode::syntax,
               "the file of the tokens " + text::quote(file.string()) + " is damaged: " + why,
               "Repair it, or remove it and grant the tokens again.");
}

std::string text_in(const Map& m, std::string_view key) {
  const Value* v = m.find(key);
  const std::string* s = v ? v->as_string() : nullptr;
  return s ? *s : std::string();
}
std::int64_t whole_in(const Map& m, std::string_view key) {
  const Value* v = m.find(key);
  const std::int64_t* i = v ? v->as_int() : nullptr;
  return i ? *i : 0;
}

Result<void> check_name(const std::string& name) {
  const bool is_fine = !name.empty() && name.size() <= kLongestName &&
                       std::all_of(name.begin(), name.end(), [](char c) {
                         return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') ||
                                (c >= '0' && c <= '9') || c == '-' || c == '_' || c == '.';
                       });
  if (is_fine) return {};
  return error(ErrorCode::invalid_argument,
               "a token's name must consist of 1 to " + std::to_string(kLongestName) +
                   " letters, digits, - _ and .",
               "", "name");
}

}  // namespace

fs::path Tokens::usual_file() {
  if (const char* config = std::getenv("XDG_CONFIG_HOME"); config && *config == '/')
    return fs::path(config) / "robomosp" / "tokens.json";
  if (const char* home = std::getenv("HOME"); home && *home == '/')
    return fs::path(home) / ".config" / "robomosp" / "tokens.json";
  return {};
}

Result<Tokens> Tokens::open(fs::path file) {
  if (file.empty())
    return error(ErrorCode::invalid_argument, "there is no file for tokens",
                 "Set HOME or XDG_CONFIG_HOME, or name a file.");
  Tokens out(std::move(file));
  if (const auto tokens = out.read(); !tokens.ok()) return tokens.error();
  return out;
}

Result<std::vector<Token>> Tokens::read() const {
  const File file(file_, O_RDONLY);
  if (file.fd() < 0) {
    if (errno == ENOENT || errno == ENOTDIR) return std::vector<Token>{};
    return cannot(file_, "read");
  }
  RMP_TRY(check_mode(file.fd(), file_));
  std::string bytes;
  char piece[4096];
  for (;;) {
    const ssize_t n = ::read(file.fd(), piece, sizeof piece);
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) return cannot(file_, "read");
    if (n == 0) break;
    bytes.append(piece, static_cast<std::size_t>(n));
    if (bytes.size() > kLargestFile) return damaged(file_, "it is larger than 16 MiB");
  }
  const auto content = from_json(bytes);
  if (!content.ok()) return damaged(file_, content.error().sentence());
  const Map* root = content->as_map();
  const Value* entries = root ? root->find("tokens") : nullptr;
  if (!entries || !entries->as_list()) return damaged(file_, "the list tokens is missing");
  std::vector<Token> out;
  for (const Value& entry : *entries->as_list()) {
    const Map* m = entry.as_map();
    if (!m) return damaged(file_, "an entry is not a table");
    Token t;
    t.rights.name = text_in(*m, "name");
    t.hash = text_in(*m, "sha256");
    if (t.rights.name.empty() || t.hash.size() != 64)
      return damaged(file_, "an entry has no name or no hash");
    t.rights.effects = {};
    const Value* effects = m->find("effects");
    if (!effects || !effects->as_list()) return damaged(file_, t.rights.name + " has no effects");
    for (const Value& word : *effects->as_list()) {
      bool is_known = false;
      for (const Effect e : kAllEffects)
        if (word.as_string() && to_string(e) == *word.as_string()) {
          t.rights.effects = t.rights.effects | e;
          is_known = true;
        }
      if (!is_known)
        return damaged(file_,
                       t.rights.name + " has the effect " + word.text() + ", which does not exist");
    }
    if (const Value* commands = m->find("commands"); commands && commands->as_list())
      for (const Value& word : *commands->as_list())
        if (word.as_string()) t.rights.commands.push_back(*word.as_string());
    t.rights.folder = text_in(*m, "folder");
    t.rights.rate = static_cast<std::uint64_t>(std::max<std::int64_t>(0, whole_in(*m, "rate")));
    t.created = whole_in(*m, "created");
    t.expires = whole_in(*m, "expires");
    out.push_back(std::move(t));
  }
  return out;
}

Result<void> Tokens::write(const std::vector<Token>& tokens) const {
  List entries;
  for (const Token& t : tokens) {
    List effects, commands;
    for (const Effect e : t.rights.effects.list()) effects.emplace_back(to_string(e));
    for (const std::string& c : t.rights.commands) commands.emplace_back(c);
    entries.emplace_back(Map{{"name", t.rights.name},
                             {"sha256", t.hash},
                             {"effects", std::move(effects)},
                             {"commands", std::move(commands)},
                             {"folder", t.rights.folder.string()},
                             {"rate", static_cast<std::int64_t>(t.rights.rate)},
                             {"created", t.created},
                             {"expires", t.expires}});
  }
  const std::string bytes = to_json(Map{{"tokens", std::move(entries)}}) + "\n";
  const fs::path fresh = file_.string() + "." + std::to_string(::getpid()) + ".new";
  (void)::unlink(fresh.c_str());
  {
    const File file(fresh, O_WRONLY | O_CREAT | O_EXCL);
    if (file.fd() < 0) return cannot(file_, "written");
    std::string_view rest = bytes;
    while (!rest.empty()) {
      const ssize_t n = ::write(file.fd(), rest.data(), rest.size());
      if (n < 0 && errno == EINTR) continue;
      if (n <= 0 || ::fsync(file.fd()) != 0) {
        const Error e = cannot(file_, "written");
        (void)::unlink(fresh.c_str());
        return e;
      }
      rest.remove_prefix(static_cast<std::size_t>(n));
    }
  }
  if (::rename(fresh.c_str(), file_.c_str()) != 0) {
    const Error e = cannot(file_, "written");
    (void)::unlink(fresh.c_str());
    return e;
  }
  return {};
}

Result<std::string> Tokens::grant(Rights rights, std::int64_t seconds) {
  RMP_TRY(check_name(rights.name));
  if (rights.effects.meets(kByNameOnly))
    return error(ErrorCode::invalid_argument,
                 "a token cannot have the effects loads_code, stops and administers",
                 "Grant the commands by name: commands = {\"plugin.load\"}.", "effects");
  if (rights.rate > kHighestRate)
    return error(ErrorCode::invalid_argument,
                 "a rate is at most " + std::to_string(kHighestRate) + " requests per second", "",
                 "rate");
  if (!rights.folder.empty()) {
    std::error_code ec;
    const fs::path whole = fs::canonical(rights.folder, ec);
    if (ec || !fs::is_directory(whole, ec))
      return error(ErrorCode::not_found,
                   "there is no folder " + text::quote(rights.folder.string()),
                   "Create the folder first.", "folder");
    rights.folder = whole;
  }
  std::error_code ec;
  const fs::path folder = file_.parent_path();
  if (!folder.empty() && !fs::is_directory(folder, ec)) {
    fs::create_directories(folder, ec);
    if (ec) return cannot(file_, "written");
    fs::permissions(folder, fs::perms::owner_all, ec);
  }
  const File alone(file_.string() + ".lock", O_RDWR | O_CREAT);
  if (alone.fd() < 0 || ::flock(alone.fd(), LOCK_EX) != 0) return cannot(file_, "written");
  RMP_TRY_ASSIGN(std::vector<Token> tokens, read());
  const std::int64_t time = now();
  std::erase_if(tokens, [&](const Token& t) {
    return t.rights.name == rights.name && t.expires != 0 && t.expires <= time;
  });
  for (const Token& t : tokens)
    if (t.rights.name == rights.name)
      return error(ErrorCode::conflict, "there is a token " + text::quote(rights.name) + " already",
                   "Choose another name, or server.revoke it first.", "name");
  RMP_TRY_ASSIGN(std::string secret, random_secret());
  Token t;
  t.rights = std::move(rights);
  t.hash = sha256(secret);
  t.created = time;
  t.expires = seconds > 0 ? time + seconds : 0;
  tokens.push_back(std::move(t));
  RMP_TRY(write(tokens));
  return secret;
}

Result<void> Tokens::revoke(std::string_view name) {
  const File alone(file_.string() + ".lock", O_RDWR | O_CREAT);
  if (alone.fd() < 0 || ::flock(alone.fd(), LOCK_EX) != 0) return cannot(file_, "written");
  RMP_TRY_ASSIGN(std::vector<Token> tokens, read());
  if (std::erase_if(tokens, [&](const Token& t) { return t.rights.name == name; }) == 0)
    return error(ErrorCode::unknown_name, "there is no token " + text::quote(std::string(name)),
                 "server.tokens() lists them.", "name");
  return write(tokens);
}

Result<Token> Tokens::find(std::string_view secret) const {
  RMP_TRY_ASSIGN(const std::vector<Token> tokens, read());
  const std::string hash = sha256(secret);
  const Token* found = nullptr;  // all are compared, so that the time tells nothing
  for (const Token& t : tokens)
    if (equal_in_constant_time(t.hash, hash)) found = &t;
  if (!found)
    return error(ErrorCode::permission, "the token is unknown here",
                 "Get one from the server's administrator (server.grant).");
  if (found->expires != 0 && found->expires <= now())
    return error(ErrorCode::permission,
                 "the token " + text::quote(found->rights.name) + " has expired",
                 "Get a new one from the server's administrator (server.grant).");
  return *found;
}

Result<std::vector<Token>> Tokens::list() const { return read(); }

}  // namespace robomosp::remote
