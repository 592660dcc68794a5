// SPDX-License-Identifier: Apache-2.0
// Solvers written in Lua that came with the records of the document: text until the user trusts it,
// then provided like others (layer: application, ioci). Lua itself is not known here: a LuaState
// runs what is trusted.
#pragma once

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <mutex>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <robomosp/sdk/result.h>

#include "document/document.h"
#include "model/kept_solver.h"

namespace robomosp::ioci {

class Application;

/// A solver that the document keeps, as it would be provided. Where records keep several of one
/// interface and name, the text of the oldest record counts.
struct KeptEntry {
  model::KeptSolver solver;
  std::vector<AnyId> keepers;  ///< records that keep this text, the oldest first
  std::vector<AnyId> others;   ///< records that keep another text under this name
  bool is_trusted = false;
  bool is_provided = false;
  std::string fault;  ///< why it is trusted and still not there; "" = none
};

/// [any thread] unless marked.
class KeptSolvers {
 public:
  /// Runs Lua for it. At most one at a time is asked.
  class Host {
   public:
    Host() = default;
    Host(const Host&) = delete;
    Host& operator=(const Host&) = delete;
    virtual ~Host() = default;
    /// Runs the text apart from everything: does it give that solver? [the host's thread]
    virtual Result<void> try_out(const model::KeptSolver&) = 0;
    /// wanted() has changed; at once when this is the host's thread, else when it comes to it.
    virtual void follow() = 0;
    /// Whether it runs on this thread.
    [[nodiscard]] virtual bool is_here() const = 0;
  };

  explicit KeptSolvers(Application& app) : app_(app) {}
  /// From now on it follows the document.
  void start();

  /// The first host stays until it leaves.
  void enter(Host*);
  void leave(Host*);
  /// Runs the text apart, where there is a host on this thread; ok without one.
  Result<void> try_out(const model::KeptSolver&);

  /// By interface and name.
  [[nodiscard]] std::vector<KeptEntry> list() const;
  /// Those to be provided: trusted, with the origin that providers get.
  struct Wanted {
    model::KeptSolver solver;
    std::string origin;
  };
  [[nodiscard]] std::vector<Wanted> wanted() const;
  /// Counts up whenever wanted() changes.
  [[nodiscard]] std::uint64_t revision() const { return revision_.load(std::memory_order_acquire); }
  /// What became of one of wanted(): "" = it is provided.
  void report(const model::KeptSolver&, std::string fault);

  /// From now on the text is run; `remember` = in every run of the user's.
  Result<void> trust(const std::string& text, bool remember);
  /// No longer, nor in runs to come.
  Result<void> distrust(const std::string& text);
  /// Everything that this run loads; is not remembered.
  void trust_all();
  [[nodiscard]] bool is_trusted(const std::string& text) const;
  /// Those that nobody has been asked about in this run; each is given once.
  [[nodiscard]] std::vector<KeptEntry> take_unasked();

  /// Where the text of what a script provides is found, as `provider.keep` takes it: "" = unknown.
  void note_source(const std::string& interface_id, const std::string& name, std::string text);
  [[nodiscard]] std::string source_of(const std::string& interface_id,
                                      const std::string& name) const;

 private:
  using Key = std::pair<std::string, std::string>;  ///< interface and name
  void read_document();
  void give_reasons();  ///< to the registry, for what is not there
  void update();        ///< the same, and the host follows
  [[nodiscard]] bool is_trusted_locked(const std::string& text) const;

  Application& app_;
  std::atomic<std::uint64_t> revision_{0};
  std::recursive_mutex host_mutex_;
  Host* host_ = nullptr;  // guarded by host_mutex_
  mutable std::mutex mutex_;
  // Guarded by mutex_:
  std::map<Key, KeptEntry> entries_;
  std::map<Key, std::string> sources_;
  std::set<std::string, std::less<>> trusted_, distrusted_, asked_, told_;  ///< texts
  bool trusts_all_ = false;
};

/// $XDG_CONFIG_HOME/robomosp/trusted, or below ~/.config: a file for every text that the user
/// trusts; empty without a home.
[[nodiscard]] std::filesystem::path trusted_folder();

/// `ik "scara", kept with robot "cobra"`
[[nodiscard]] std::string described(const document::Snapshot&, const KeptEntry&);

}  // namespace robomosp::ioci
