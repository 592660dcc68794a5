// SPDX-License-Identifier: Apache-2.0
#include "ioci/core/kept_solvers.h"

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <system_error>

#include "io/native.h"
#include "ioci/core/application.h"
#include "kernel/fingerprint.h"
#include "kernel/interface_adapters.h"
#include "kernel/text.h"

namespace robomosp::ioci {
namespace {

/// "ik" of "robomosp.ik/1": what users call the interface.
std::string brief(const std::string& interface_id) {
  const auto dot = interface_id.find('.');
  return interface_id.substr(dot == std::string::npos ? 0 : dot + 1,
                             interface_id.find('/') - (dot == std::string::npos ? 0 : dot + 1));
}

/// `"ik", "scara"`, as commands take it.
std::string arguments(const model::KeptSolver& s) {
  return text::quote(brief(s.interface)) + ", " + text::quote(s.name);
}

/// The file that remembers a text; the text itself is in it, so that no other text is taken for it.
std::filesystem::path file_of(const std::string& text) {
  const std::filesystem::path folder = trusted_folder();
  if (folder.empty()) return {};
  return folder /
         (Fingerprinter("trusted solver/1").add(std::string_view(text)).finish().hex() + ".lua");
}

bool is_remembered(const std::string& text) {
  std::ifstream in(file_of(text), std::ios::binary);
  return in && std::string((std::istreambuf_iterator<char>(in)), {}) == text;
}

}  // namespace

std::filesystem::path trusted_folder() {
  const char* config = std::getenv("XDG_CONFIG_HOME");
  const char* home = std::getenv("HOME");
  if (config && *config == '/') return std::filesystem::path(config) / "robomosp" / "trusted";
  if (home && *home) return std::filesystem::path(home) / ".config" / "robomosp" / "trusted";
  return {};
}

std::string described(const document::Snapshot& snapshot, const KeptEntry& e) {
  return brief(e.solver.interface) + " " + text::quote(e.solver.name) + " of " +
         snapshot.describe(e.keepers.front());
}

void KeptSolvers::start() {
  app_.document.on_commit([this](const document::Commit& commit) {
    const auto keeps = [](const document::RecordPtr& r) { return r && !r->solvers.empty(); };
    bool is_touched = commit.kind == document::CommitKind::clear;
    for (const document::RecordChange& c : commit.records)
      is_touched = is_touched || keeps(c.before) || keeps(c.after);
    if (is_touched) read_document();
  });
}

void KeptSolvers::read_document() {
  const document::SnapshotPtr now = app_.document.now();
  std::vector<AnyId> ids = now->list();
  std::sort(ids.begin(), ids.end(), [](AnyId a, AnyId b) { return a.number < b.number; });
  std::vector<std::string> fresh, shadowed;
  {
    const std::lock_guard lock(mutex_);
    std::map<Key, KeptEntry> before;
    before.swap(entries_);
    for (const AnyId id : ids)
      for (model::KeptSolver s : now->find(id)->solvers) {
        if (const std::string current = current_interface(s.interface); !current.empty())
          s.interface = current;
        KeptEntry& e = entries_[{s.interface, s.name}];
        if (e.keepers.empty()) {
          e.solver = s;
          e.is_trusted = is_trusted_locked(e.solver.text);
          const auto was = before.find({e.solver.interface, e.solver.name});
          if (was != before.end() && was->second.solver == e.solver) {
            e.is_provided = was->second.is_provided;
            e.fault = was->second.fault;
          }
        }
        (e.solver == s ? e.keepers : e.others).push_back(id);
      }
    for (const auto& [key, e] : entries_) {
      if (!e.is_trusted && told_.insert(e.solver.text).second) fresh.push_back(described(*now, e));
      const auto was = before.find(key);
      if (!e.others.empty() && (was == before.end() || was->second.others != e.others))
        shadowed.push_back("There are two texts of the solver " + described(*now, e) + "; " +
                           now->describe(e.others.front()) +
                           " keeps the other one, which is not used.");
    }
  }
  if (!fresh.empty()) {
    constexpr std::size_t kNamed = 8;
    const std::size_t count = fresh.size();
    if (count > kNamed) {
      fresh.resize(kNamed);
      fresh.push_back(std::to_string(count - kNamed) + " more");
    }
    app_.messages.post(
        Severity::warning, "untrusted_solver",
        (count == 1 ? std::string("A solver in Lua came with this document, and is not run: ")
                    : std::to_string(count) +
                          " solvers in Lua came with this document, and are not run: ") +
            text::enumerate(fresh) +
            ". provider.text(interface, name) shows one, provider.trust(interface, name) lets it "
            "run.",
        "provider");
  }
  for (const std::string& sentence : shadowed)
    app_.messages.post(Severity::warning, "solver_shadowed", sentence, "provider");
  update();
}

void KeptSolvers::give_reasons() {
  Registry::Reasons reasons;
  const document::SnapshotPtr now = app_.document.now();
  {
    const std::lock_guard lock(mutex_);
    for (auto& [key, e] : entries_) {
      e.is_trusted = is_trusted_locked(e.solver.text);
      const std::string who = "the " + brief(e.solver.interface) + " solver " +
                              text::quote(e.solver.name) + " came as Lua with " +
                              now->describe(e.keepers.front());
      if (!e.is_trusted)
        reasons[key] = {who + " and is not run until you trust it",
                        "Read it: provider.text(" + arguments(e.solver) +
                            "). Then let it run: provider.trust(" + arguments(e.solver) + ")."};
      else if (!e.fault.empty())
        reasons[key] = {who + " and could not be run: " + e.fault,
                        "Correct its text and keep it again: provider.keep."};
      else
        reasons[key] = {who + ", and no session runs it yet",
                        "Ask again when the console or script has come to it."};
    }
  }
  app_.registry.set_absent_reasons(std::move(reasons));
}

void KeptSolvers::update() {
  give_reasons();
  revision_.fetch_add(1, std::memory_order_acq_rel);
  const std::lock_guard lock(host_mutex_);
  if (host_) host_->follow();
}

void KeptSolvers::enter(Host* host) {
  const std::lock_guard lock(host_mutex_);
  if (!host_) host_ = host;
}
void KeptSolvers::leave(Host* host) {
  const std::lock_guard lock(host_mutex_);
  if (host_ == host) host_ = nullptr;
}

Result<void> KeptSolvers::try_out(const model::KeptSolver& s) {
  const std::lock_guard lock(host_mutex_);
  if (!host_ || !host_->is_here()) return {};
  return host_->try_out(s);
}

std::vector<KeptEntry> KeptSolvers::list() const {
  const std::lock_guard lock(mutex_);
  std::vector<KeptEntry> out;
  for (const auto& [key, e] : entries_) out.push_back(e);
  return out;
}

std::vector<KeptSolvers::Wanted> KeptSolvers::wanted() const {
  const document::SnapshotPtr now = app_.document.now();
  const std::lock_guard lock(mutex_);
  std::vector<Wanted> out;
  for (const auto& [key, e] : entries_)
    if (e.is_trusted) out.push_back({e.solver, "kept with " + now->describe(e.keepers.front())});
  return out;
}

void KeptSolvers::report(const model::KeptSolver& s, std::string fault) {
  std::string said;
  {
    const document::SnapshotPtr now = app_.document.now();
    const std::lock_guard lock(mutex_);
    const auto it = entries_.find({s.interface, s.name});
    if (it == entries_.end()) return;
    KeptEntry& e = it->second;
    if (e.fault == fault && e.is_provided == fault.empty()) return;
    e.is_provided = fault.empty();
    e.fault = std::move(fault);
    if (!e.fault.empty()) said = "The solver " + described(*now, e) + " was left out: " + e.fault;
  }
  give_reasons();
  if (said.empty()) return;
  app_.messages.post(Severity::warning, "kept_solver", said, "provider");
}

bool KeptSolvers::is_trusted_locked(const std::string& text) const {
  return trusts_all_ || trusted_.contains(text) ||
         (!distrusted_.contains(text) && is_remembered(text));
}
bool KeptSolvers::is_trusted(const std::string& text) const {
  const std::lock_guard lock(mutex_);
  return is_trusted_locked(text);
}

Result<void> KeptSolvers::trust(const std::string& text, bool remember) {
  if (remember && !is_remembered(text)) {
    const std::filesystem::path file = file_of(text);
    if (file.empty())
      return error(ErrorCode::io, "there is no home folder to store what is trusted",
                   "Set HOME or XDG_CONFIG_HOME, or give remember = false.");
    std::error_code failed;
    std::filesystem::create_directories(file.parent_path(), failed);  // write_file says what failed
    RMP_TRY(io::write_file(file, text));
  }
  {
    const std::lock_guard lock(mutex_);
    trusted_.insert(text);
    distrusted_.erase(text);
    told_.insert(text);
  }
  update();
  return {};
}

Result<void> KeptSolvers::distrust(const std::string& text) {
  if (is_remembered(text)) {
    std::error_code failed;
    std::filesystem::remove(file_of(text), failed);
    if (failed)
      return error(ErrorCode::io,
                   "the file " + text::quote(file_of(text).string()) +
                       " that stores it cannot be removed: " + failed.message(),
                   "Remove it manually.");
  }
  {
    const std::lock_guard lock(mutex_);
    trusted_.erase(text);
    distrusted_.insert(text);
    trusts_all_ = false;
  }
  update();
  return {};
}

void KeptSolvers::trust_all() {
  {
    const std::lock_guard lock(mutex_);
    trusts_all_ = true;
  }
  update();
}

std::vector<KeptEntry> KeptSolvers::take_unasked() {
  const std::lock_guard lock(mutex_);
  std::vector<KeptEntry> out;
  for (const auto& [key, e] : entries_)
    if (!e.is_trusted && !distrusted_.contains(e.solver.text) &&
        asked_.insert(e.solver.text).second)
      out.push_back(e);
  return out;
}

void KeptSolvers::note_source(const std::string& interface_id, const std::string& name,
                              std::string text) {
  const std::lock_guard lock(mutex_);
  sources_[{interface_id, name}] = std::move(text);
}
std::string KeptSolvers::source_of(const std::string& interface_id, const std::string& name) const {
  const std::lock_guard lock(mutex_);
  const auto it = sources_.find({interface_id, name});
  return it == sources_.end() ? std::string() : it->second;
}

}  // namespace robomosp::ioci
