// SPDX-License-Identifier: Apache-2.0
// Drafts of sessions: edits invisible to other sessions until they are accepted as one step (layer:
// application).
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include <robomosp/sdk/progress.h>
#include <robomosp/sdk/result.h>

#include "document/draft.h"

namespace robomosp::ioci {

class Application;
class Session;

/// Kept with the application (Application::kept()). A draft belongs to the session that opened it
/// and is discarded with it; its threads are the session's own and those of its jobs. [any thread]
class Drafts {
 public:
  explicit Drafts(Application& app) : app_(app) {}
  struct Entry {
    std::uint64_t number = 0;  ///< counts up, never reused
    std::shared_ptr<document::Draft> draft;
    std::weak_ptr<const int> session;  ///< expired = it has ended
  };
  /// On the records as they are now. [the session's thread, as all below that name one]
  std::uint64_t open(Session&, std::string label);
  /// A draft of the session, open or being accepted. ErrorCode::unknown_name.
  [[nodiscard]] Result<std::shared_ptr<document::Draft>> own(Session&, std::uint64_t number);
  /// Publishes it as one step, document::Draft::accept(). Refused while a job works on it.
  Result<document::Commit> accept(Session&, std::uint64_t number, const Progress&);
  /// Cancels the jobs that work on it, without waiting for them, and drops it.
  Result<void> discard(Session&, std::uint64_t number);
  /// All open drafts, of all sessions, by number.
  [[nodiscard]] std::vector<Entry> list();
  /// Jobs that work on a draft or wait to.
  [[nodiscard]] std::vector<std::uint64_t> jobs_of(std::uint64_t number) const;
  /// Publishes the changes of a commit on a draft to subscribers.
  void tell_edited(std::uint64_t number, const document::Draft&, const document::Commit&);

 private:
  void tell(const char* what, std::uint64_t number, const document::Draft&,
            const std::vector<AnyId>& changed);
  /// Discards the drafts of sessions that have ended. With mutex_ held; the caller reports the
  /// returned drafts after releasing it.
  [[nodiscard]] std::vector<Entry> end_orphans();
  void tell_discarded(const std::vector<Entry>& ended);
  Application& app_;
  mutable std::mutex mutex_;
  std::map<std::uint64_t, Entry> drafts_;  // guarded by mutex_; by number
  std::uint64_t next_ = 1;                 // guarded by mutex_
  std::size_t most_ = 16;                  // guarded by mutex_; number of drafts above which
                                           // orphans are searched
};

}  // namespace robomosp::ioci
