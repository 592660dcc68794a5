// SPDX-License-Identifier: Apache-2.0
#include "io/recovery_journal.h"

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <map>
#include <optional>
#include <set>
#include <system_error>
#include <utility>

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include "io/geometry.h"
#include "io/native.h"
#include "io/native_print.h"
#include "io/write_all.h"
#include "kernel/fingerprint.h"
#include "kernel/text.h"

namespace robomosp::io {
namespace {

namespace fs = std::filesystem;
using document::Snapshot;

constexpr std::string_view kMagic = "robomosp-recovery 1 ";
constexpr std::string_view kExtension = ".journal";
constexpr std::uint64_t kRewriteFrom = std::uint64_t{4} << 20;  // smaller files may grow
constexpr std::uint64_t kRewriteRatio = 4;                      // of the file to what it must hold
constexpr std::size_t kMostJournal = std::size_t{4} << 30;

std::string utc_now() {
  const std::time_t now = std::time(nullptr);
  std::tm parts{};
  ::gmtime_r(&now, &parts);
  char text[32];
  std::strftime(text, sizeof text, "%Y-%m-%d %H:%M:%S UTC", &parts);
  return text;
}

/// What a record is called within a journal: stable, whatever its name and file become.
std::string inner_name(AnyId id) {
  return std::string(to_string(id.kind)) + "-" + std::to_string(id.number) +
         std::string(extension(id.kind));
}

std::string checksum(std::string_view payload) {
  return Fingerprinter("recovery/1").add(payload).finish().hex();
}

/// One entry of a journal: lines that name what follows them by its length.
class JournalEntry {
 public:
  void line(const std::string& words) { payload_ += words + "\n"; }
  void bytes(std::string_view more) { payload_.append(more).push_back('\n'); }
  [[nodiscard]] std::string text() const {
    return "entry " + std::to_string(payload_.size()) + " " + checksum(payload_) + "\n" + payload_;
  }

 private:
  std::string payload_;
};

/// What a journal holds in the end.
struct Image {
  struct Item {
    std::string file, text;
  };
  std::string program, time;
  std::map<std::uint64_t, std::pair<std::string, Item>> records;  ///< number -> name within
  std::map<std::string, std::string> geometries;
  std::size_t unread = 0;
};

/// Reads words and counted bytes from a text; any fault ends it.
class Cursor {
 public:
  explicit Cursor(std::string_view text) : rest_(text) {}
  [[nodiscard]] bool at_end() const { return rest_.empty(); }
  std::optional<std::string_view> line() {
    const auto end = rest_.find('\n');
    if (end == std::string_view::npos) return std::nullopt;
    const std::string_view out = rest_.substr(0, end);
    rest_.remove_prefix(end + 1);
    return out;
  }
  std::optional<std::string_view> bytes(std::size_t count, bool with_end = true) {
    if (rest_.size() < count + (with_end ? 1U : 0U)) return std::nullopt;
    const std::string_view out = rest_.substr(0, count);
    rest_.remove_prefix(count + (with_end ? 1U : 0U));
    return out;
  }
  [[nodiscard]] std::size_t left() const { return rest_.size(); }

 private:
  std::string_view rest_;
};

std::optional<std::uint64_t> count_of(std::string_view word) {
  const auto n = text::read_int(word);
  if (!n || *n < 0) return std::nullopt;
  return static_cast<std::uint64_t>(*n);
}

/// Applies one entry; false when it is not what this program writes.
bool apply(std::string_view payload, Image& image) {
  Cursor in(payload);
  while (!in.at_end()) {
    const auto line = in.line();
    if (!line) return false;
    const auto words = text::split(*line, ' ');
    if (words[0] == "time" && words.size() >= 2) {
      image.time = line->substr(5);
    } else if (words[0] == "whole") {
      image.records.clear();
      image.geometries.clear();
    } else if (words[0] == "drop" && words.size() == 2) {
      const auto number = count_of(words[1]);
      if (!number) return false;
      image.records.erase(*number);
    } else if (words[0] == "put" && words.size() == 5) {
      const auto number = count_of(words[1]), file = count_of(words[3]), size = count_of(words[4]);
      if (!number || !file || !size) return false;
      const auto file_text = in.bytes(*file), text = in.bytes(*size);
      if (!file_text || !text) return false;
      image.records[*number] = {std::string(words[2]),
                                {std::string(*file_text), std::string(*text)}};
    } else if (words[0] == "geometry" && words.size() == 3) {
      const auto size = count_of(words[2]);
      const auto bytes = size ? in.bytes(*size) : std::nullopt;
      if (!bytes) return false;
      image.geometries[std::string(words[1])] = std::string(*bytes);
    } else {
      return false;
    }
  }
  return true;
}

/// The entries of a journal up to the first that is not whole.
std::optional<Image> read_image(std::string_view bytes) {
  Cursor in(bytes);
  const auto head = in.line();
  if (!head || !head->starts_with(kMagic)) return std::nullopt;
  Image image;
  image.program = head->substr(kMagic.size());
  while (!in.at_end()) {
    const std::size_t before = in.left();
    const auto line = in.line();
    const auto words = line ? text::split(*line, ' ') : std::vector<std::string_view>{};
    const auto size = words.size() == 3 && words[0] == "entry" ? count_of(words[1]) : std::nullopt;
    const auto payload = size ? in.bytes(*size, false) : std::nullopt;
    if (!payload || checksum(*payload) != words[2] || !apply(*payload, image)) {
      image.unread = before;
      break;
    }
  }
  return image;
}

/// Opens a journal and locks it; -1 when it is not there or a living process holds it.
int open_locked(const fs::path& file) {
  const int fd = ::open(file.c_str(), O_RDONLY | O_CLOEXEC | O_NOFOLLOW);
  if (fd < 0) return -1;
  if (::flock(fd, LOCK_EX | LOCK_NB) == 0) {
    // Its owner may have replaced or removed it between the two calls.
    struct stat here {
    }, there{};
    if (::fstat(fd, &here) == 0 && ::stat(file.c_str(), &there) == 0 &&
        here.st_ino == there.st_ino && here.st_dev == there.st_dev)
      return fd;
  }
  ::close(fd);
  return -1;
}

std::optional<Image> read_image_of(int fd) {
  std::string bytes;
  char buffer[1 << 16];
  if (::lseek(fd, 0, SEEK_SET) != 0) return std::nullopt;
  for (;;) {
    const ssize_t n = ::read(fd, buffer, sizeof buffer);
    if (n < 0 && errno == EINTR) continue;
    if (n < 0 || bytes.size() > kMostJournal) return std::nullopt;
    if (n == 0) return read_image(bytes);
    bytes.append(buffer, static_cast<std::size_t>(n));
  }
}

}  // namespace

fs::path recovery_folder() {
  if (const char* state = std::getenv("XDG_STATE_HOME"); state && *state == '/')
    return fs::path(state) / "robomosp" / "recovery";
  if (const char* home = std::getenv("HOME"); home && *home)
    return fs::path(home) / ".local" / "state" / "robomosp" / "recovery";
  return {};
}

/// The file of a journal, open and locked.
class RecoveryJournal::File {
 public:
  File(int fd, fs::path path) : path_(std::move(path)), fd_(fd) {}
  ~File() { ::close(fd_); }
  File(const File&) = delete;
  File& operator=(const File&) = delete;

  static Result<std::unique_ptr<File>> make(const fs::path& path, const std::string& program) {
    const int fd = ::open(path.c_str(), O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC, 0600);
    const auto refused = [&](int number) {
      return error(ErrorCode::io, "cannot write " + text::quote(path.string()) + ": " +
                                      std::generic_category().message(number));
    };
    if (fd < 0) return refused(errno);
    auto file = std::make_unique<File>(fd, path);
    if (::flock(fd, LOCK_EX | LOCK_NB) != 0) return refused(errno);
    RMP_TRY(file->append(std::string(kMagic) + program + "\n"));
    return file;
  }

  /// All of it, on the disk, or nothing.
  Result<void> append(std::string_view bytes) {
    int failure = write_all(fd_, bytes);
    if (!failure && ::fdatasync(fd_) != 0) failure = errno;
    if (failure) {
      // What is there of it must not stand before the next entry.
      if (::ftruncate(fd_, static_cast<off_t>(size_)) == 0)
        (void)::lseek(fd_, static_cast<off_t>(size_), SEEK_SET);
      return error(ErrorCode::io, "cannot write " + text::quote(path_.string()) + ": " +
                                      std::generic_category().message(failure));
    }
    size_ += bytes.size();
    return {};
  }
  Result<void> rename(const fs::path& to) {
    if (::rename(path_.c_str(), to.c_str()) != 0)
      return error(ErrorCode::io, "cannot replace " + text::quote(to.string()) + ": " +
                                      std::generic_category().message(errno));
    path_ = to;
    return {};
  }
  void remove() const { ::unlink(path_.c_str()); }
  [[nodiscard]] std::uint64_t size() const { return size_; }
  [[nodiscard]] const fs::path& path() const { return path_; }

 private:
  fs::path path_;
  int fd_;
  std::uint64_t size_ = 0;
};

RecoveryJournal::RecoveryJournal(const document::Document& document, JournalOptions options)
    : document_(document), options_(std::move(options)) {}

void RecoveryJournal::end_thread() {
  std::thread thread;
  {
    const std::lock_guard lock(mutex_);
    is_ending_ = true;
    thread = std::move(thread_);
  }
  wake_.notify_all();
  if (thread.joinable()) thread.join();
}

RecoveryJournal::~RecoveryJournal() {
  end_thread();
  if (file_ && !is_kept_) file_->remove();
}

Result<fs::path> RecoveryJournal::keep() {
  end_thread();
  const document::SnapshotPtr now = document_.now();
  RMP_TRY(write(*now, false));
  is_kept_ = true;
  return file_->path();
}

void RecoveryJournal::changed() {
  {
    const std::lock_guard lock(mutex_);
    if (is_changed_ || is_ending_) return;
    is_changed_ = true;
    if (!thread_.joinable()) thread_ = std::thread([this] { run(); });
  }
  wake_.notify_all();
}

fs::path RecoveryJournal::file() const {
  const std::lock_guard lock(mutex_);
  return path_;
}

void RecoveryJournal::run() {
  bool is_told = false, must_be_whole = false;
  for (;;) {
    {
      std::unique_lock lock(mutex_);
      wake_.wait(lock, [&] { return is_changed_ || is_ending_; });
      // What follows at once shares the entry.
      if (wake_.wait_for(lock, options_.interval, [&] { return is_ending_; })) return;
      is_changed_ = false;
    }
    const document::SnapshotPtr now = document_.now();
    const auto done = write(*now, must_be_whole);
    must_be_whole = !done.ok();
    if (done.ok()) continue;
    if (!std::exchange(is_told, true) && options_.trouble)
      options_.trouble("Unsaved work could not be restored after a crash: " +
                       done.error().sentence());
    const std::lock_guard lock(mutex_);
    is_changed_ = true;  // again, after the interval
  }
}

Result<void> RecoveryJournal::write(const Snapshot& now, bool whole) {
  std::unique_ptr<File> fresh;
  const bool is_first = !file_;
  if (is_first || whole ||
      (file_->size() > kRewriteFrom && file_->size() > kRewriteRatio * whole_bytes_)) {
    std::error_code ec;
    fs::create_directories(options_.folder, ec);
    if (ec)
      return error(ErrorCode::io, "cannot make the folder " +
                                      text::quote(options_.folder.string()) + ": " + ec.message());
    std::string stamp = utc_now().substr(0, 19);
    std::replace(stamp.begin(), stamp.end(), ' ', '-');
    std::erase(stamp, ':');
    const fs::path path =
        is_first
            ? options_.folder / (stamp + "-" + std::to_string(::getpid()) + std::string(kExtension))
            : fs::path(file_->path().string() + ".new");
    if (!is_first) fs::remove(path, ec);  // of an attempt that failed
    RMP_TRY_ASSIGN(fresh, File::make(path, options_.program));
    written_.clear();
    geometries_.clear();
    whole = true;
  }

  JournalEntry entry;
  entry.line("time " + utc_now());
  if (whole) entry.line("whole");
  std::unordered_map<AnyId, document::RecordPtr> present;
  for (const AnyId id : now.list()) {
    document::RecordPtr record = now.share(id);
    const auto known = written_.find(id);
    const bool is_same = known != written_.end() && known->second == record;
    if (!is_same) {
      const std::string name = inner_name(id);
      RMP_TRY_ASSIGN(const std::string text, print_record(now, *record, name, inner_name));
      if (const auto* solid = std::get_if<model::Solid>(&record->body))
        for (const auto& node : solid->nodes) {
          if (!node.geometry) continue;
          const std::string inside = geometry_file_name(name, *node.geometry);
          if (!geometries_.insert(inside).second) continue;
          RMP_TRY_ASSIGN(const std::string bytes, geometry_bytes(*node.geometry));
          entry.line("geometry " + inside + " " + std::to_string(bytes.size()));
          entry.bytes(bytes);
        }
      entry.line("put " + std::to_string(id.number) + " " + name + " " +
                 std::to_string(record->file.size()) + " " + std::to_string(text.size()));
      entry.bytes(record->file);
      entry.bytes(text);
    }
    present.emplace(id, std::move(record));
  }
  for (const auto& [id, record] : written_)
    if (!present.contains(id)) entry.line("drop " + std::to_string(id.number));

  const std::string text = entry.text();
  File& file = fresh ? *fresh : *file_;
  auto done = file.append(text);
  if (done.ok() && fresh && !is_first) done = fresh->rename(file_->path());
  if (!done.ok()) {
    if (fresh) fresh->remove();
    written_.clear();  // the next one holds everything
    return done;
  }
  if (fresh) {
    file_ = std::move(fresh);
    whole_bytes_ = text.size();
    const std::lock_guard lock(mutex_);
    path_ = file_->path();
  }
  written_ = std::move(present);
  return {};
}

std::vector<FoundJournal> found_journals(const fs::path& folder) {
  std::vector<FoundJournal> out;
  std::error_code ec;
  for (fs::directory_iterator it(folder, ec), end; !ec && it != end; it.increment(ec)) {
    if (it->path().extension() != kExtension) continue;
    const int fd = open_locked(it->path());
    if (fd < 0) continue;
    if (const auto image = read_image_of(fd); image && !image->records.empty())
      out.push_back({it->path(), image->program, image->time, image->records.size(),
                     fs::file_size(it->path(), ec), image->unread});
    ::close(fd);
  }
  std::sort(out.begin(), out.end(),
            [](const FoundJournal& a, const FoundJournal& b) { return a.file < b.file; });
  return out;
}

Result<ClaimedJournal> ClaimedJournal::claim(const fs::path& file) {
  ClaimedJournal claimed;
  claimed.descriptor_ = open_locked(file);
  claimed.file_ = file;
  if (claimed.descriptor_ < 0) {
    std::error_code ec;
    if (!fs::exists(file, ec))
      return error(ErrorCode::not_found, "there is no journal " + text::quote(file.string()),
                   "recovery.list lists them.");
    return error(ErrorCode::conflict,
                 "the journal " + text::quote(file.string()) + " belongs to a running process",
                 "Continue the work there.");
  }
  return claimed;
}

ClaimedJournal::ClaimedJournal(ClaimedJournal&& o) noexcept
    : file_(std::move(o.file_)), descriptor_(std::exchange(o.descriptor_, -1)) {}
ClaimedJournal& ClaimedJournal::operator=(ClaimedJournal&& o) noexcept {
  std::swap(file_, o.file_);
  std::swap(descriptor_, o.descriptor_);
  return *this;
}
ClaimedJournal::~ClaimedJournal() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

void ClaimedJournal::discard() {
  if (descriptor_ < 0) return;
  ::unlink(file_.c_str());
  ::close(std::exchange(descriptor_, -1));
}

Result<std::size_t> ClaimedJournal::unsaved(const std::vector<fs::path>& library) const {
  document::Document scratch;
  RMP_TRY_ASSIGN(auto tx, scratch.begin("read"));
  std::vector<std::string> notes;
  RMP_TRY(restore(tx, library, notes));
  // What could not be read is not known to be saved.
  return notes.size() + unsaved_records(tx.now(), library).size();
}

bool is_unsaved(const Snapshot& now, AnyId id, const std::vector<fs::path>& library) {
  const std::string& file = now.find(id)->file;
  if (file.empty()) return true;
  const auto text = print(now, id, file, library);
  return !text.ok() || !file_holds(file, *text);
}

std::vector<AnyId> unsaved_records(const Snapshot& now, const std::vector<fs::path>& library) {
  std::vector<AnyId> out;
  for (const AnyId id : now.list())
    if (is_unsaved(now, id, library)) out.push_back(id);
  return out;
}

Result<std::vector<AnyId>> ClaimedJournal::restore(document::Transaction& tx,
                                                   const std::vector<fs::path>& library,
                                                   std::vector<std::string>& notes) const {
  const auto image = descriptor_ >= 0 ? read_image_of(descriptor_) : std::nullopt;
  if (!image)
    return error(ErrorCode::syntax,
                 text::quote(file_.string()) + " is not a journal of this program",
                 "recovery.list lists the journals.");
  MemoryFiles files;
  for (const auto& [name, bytes] : image->geometries) {
    const auto form = fs::path(name).extension() == geometry_extension(CsgGeometry::Form::mesh)
                          ? CsgGeometry::Form::mesh
                          : CsgGeometry::Form::brep;
    auto geometry = parse_geometry(form, bytes, name);
    if (geometry.ok()) files.geometries.emplace(name, std::move(*geometry));
    else notes.push_back(geometry.error().sentence());
  }
  std::vector<std::string> names;
  for (const auto& [number, record] : image->records) {
    files.texts.emplace(record.first, record.second.text);
    names.push_back(record.first);
  }
  const std::string shown = file_.filename().string();
  auto loaded = load_memory(tx, files, names, shown, file_.parent_path(), library);
  std::set<std::string> taken;
  for (const AnyId id : tx.now().list()) taken.insert(tx.now().find(id)->file);
  std::vector<AnyId> out;
  std::size_t i = 0;
  for (const auto& [number, record] : image->records) {
    auto& one = loaded[i++];
    if (!one.ok()) {
      notes.push_back(one.error().sentence());
      continue;
    }
    out.push_back(one->id);
    for (const std::string& note : one->notes) notes.push_back(note);
    const std::string& file = record.second.file;
    if (file.empty() || !taken.insert(file).second) continue;
    RMP_TRY(tx.edit(one->id, [&](model::Record& r) -> Result<void> {
      r.file = file;
      return {};
    }));
  }
  return out;
}

}  // namespace robomosp::io
