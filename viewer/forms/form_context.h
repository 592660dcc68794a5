// SPDX-License-Identifier: GPL-3.0-or-later
// FormContext: what the fields of one form share, and questions to the client that never wait
// (layer: GUI).
#pragma once

#include <functional>
#include <memory>
#include <string>

#include <QObject>
#include <QPointer>
#include <QStringList>

#include "ioci/client/client.h"
#include "kernel/value.h"

namespace robomosp::viewer {

/// Calls a command; `done` is called on the GUI thread unless `owner` was deleted before.
inline ioci::Client::Answer ask(ioci::Client& client, std::string command, Map args, QObject* owner,
                                std::function<void(const Result<Value>&)> done) {
  return client.call(
      std::move(command), std::move(args),
      [owner = QPointer<QObject>(owner), done = std::move(done)](const Result<Value>& r) {
        if (owner) done(r);
      });
}

/// What the fields of a form share. Lives as long as one of them. [GUI thread]
struct FormContext {
  ioci::Client* client = nullptr;  ///< outlives the form; null = no choices in context
  /// What the form is of, as schema.choices takes it: {command = "robot.fk"}, {kind = "robot"} or
  /// {interface = "ik", provider = "numeric"}.
  Map of{};
  std::string title{};             ///< "robot.fk", for tool tips and object names
  bool takes_expressions = false;  ///< numbers may be expressions
  std::function<Map()> given{};    ///< the values of the whole form now
  /// Asks for the pose of the selection; `answer` may be called later. Empty = there is none.
  std::function<void(std::function<void(const Value&)> answer)> pose_of_selection{};
  /// Asks likewise for the pose of the camera of the current view.
  std::function<void(std::function<void(const Value&)> answer)> pose_of_view{};
  /// Names that expressions of the record may use.
  std::function<QStringList()> parameter_names{};
  /// Further arguments for schema.choices, such as the record shown by a form: {id = "arm"}.
  Map also_given{};
};
using FormContextPtr = std::shared_ptr<const FormContext>;

}  // namespace robomosp::viewer
