// SPDX-License-Identifier: Apache-2.0
// History: the steps made by sessions, each with the records before and after, bounded by memory
// (layer: application). Internal to modules/document.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <unordered_map>
#include <vector>

#include "document/document.h"

namespace robomosp::document {

/// A step's author and label; shared by the step and the records it changed.
struct Deed {
  Author author;
  std::string label;
};

struct Step {
  std::uint64_t number = 0;  ///< never reused
  std::shared_ptr<const Deed> deed;
  std::string series;                 ///< later commits with the same series join it
  std::vector<RecordChange> changes;  ///< in order of first touch
  std::uint64_t undone = 0;           ///< 0 = done; else incremented by every undo
  std::size_t bytes = 0;              ///< held only by the history
};

/// [application]
class History {
 public:
  explicit History(std::size_t budget) : budget_(budget) {}

  /// Adds a step, or joins it to the newest one of the same session and series. Steps that the
  /// session had undone can no longer be redone.
  void add(std::shared_ptr<const Deed> deed, std::string series, std::vector<RecordChange> changes);
  /// The step for the next undo or redo; without a session, of any. nullptr = none.
  [[nodiscard]] Step* next_undo(std::optional<std::uint64_t> session);
  [[nodiscard]] Step* next_redo(std::optional<std::uint64_t> session);
  [[nodiscard]] Step* find(std::uint64_t number);
  /// Marks a step as undone or redone; the next commit is a separate step.
  void mark(Step& step, bool undone);
  /// Ends all series: the next commit is a separate step.
  void end_series();
  std::deque<Step> clear();  ///< returns the steps

  void set_budget(std::size_t bytes);
  [[nodiscard]] std::size_t budget() const { return budget_; }
  [[nodiscard]] std::size_t bytes() const { return bytes_; }
  /// Steps forgotten to stay within the budget.
  [[nodiscard]] std::uint64_t forgotten() const { return forgotten_; }
  [[nodiscard]] const std::deque<Step>& steps() const { return steps_; }  ///< oldest first

 private:
  /// The steps of a session by number, so that none is searched for among all.
  struct Own {
    std::set<std::uint64_t> done;
    std::map<std::uint64_t, std::uint64_t> undone;  ///< by Step::undone
  };
  [[nodiscard]] static std::size_t weigh(const Step& step);
  Own& own(const Step& step) { return of_session_[step.deed->author.session]; }
  void drop_undone(std::uint64_t session);
  void bound();
  std::deque<Step> steps_;
  std::map<std::uint64_t, Own> of_session_;
  std::uint64_t open_ = 0;  ///< the step that the next commit may join; 0 = none
  std::size_t budget_, bytes_ = 0;
  std::uint64_t next_ = 1, undos_ = 0, forgotten_ = 0;
};

}  // namespace robomosp::document
