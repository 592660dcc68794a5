// SPDX-License-Identifier: GPL-3.0-or-later
// ConnectionsPanel: the server of this program with its clients and tokens, and connections to
// other programs (layer: GUI). All of it by the commands server.* and connection.*.
#pragma once

#include <functional>
#include <string>
#include <utility>
#include <vector>

#include <QStringList>
#include <QTimer>
#include <QWidget>

#include "viewer/desktop/desk.h"
#include "viewer/theme/theme.h"

class QCheckBox;
class QComboBox;
class QLabel;
class QLineEdit;
class QPlainTextEdit;
class QPushButton;
class QTabWidget;
class QTreeWidget;

namespace robomosp::viewer {

/// What a client may do: a box for each effect. [GUI thread]
class RightsRow : public QWidget {
 public:
  explicit RightsRow(const QString& name, QWidget* parent = nullptr);
  [[nodiscard]] List effects() const;

 private:
  std::vector<std::pair<std::string, QCheckBox*>> boxes_;
};

/// What a line for another program means.
struct RemoteLine {
  std::string method;
  Map params;
};
/// "robot.fk{id = "arm"}" is a command, "= 1 + 1" Lua, all else a classic line. Fails if the
/// arguments cannot be read.
[[nodiscard]] Result<RemoteLine> read_remote_line(const QString& line);

/// [GUI thread]
class ConnectionsPanel : public QWidget {
 public:
  explicit ConnectionsPanel(Desk& desk, QWidget* parent = nullptr);

  struct State {
    bool is_running = false, has_tls = false, has_browser = false;
    QStringList addresses;
    int clients = 0;
  };
  [[nodiscard]] const State& state() const { return state_; }
  /// For the status bar: "local only", or the address and the number of clients.
  [[nodiscard]] QString summary() const;

  Listeners<> changed;  ///< the state

 protected:
  void changeEvent(QEvent* event) override;
  void showEvent(QShowEvent* event) override;
  void hideEvent(QHideEvent* event) override;

 private:
  void apply_theme();
  QWidget* make_server();
  QWidget* make_clients();
  QWidget* make_tokens();
  QWidget* make_remote();
  void refresh();
  void take_state(const Map& status);
  void take_clients(const List& rows);
  void take_tokens(const List& rows);
  void take_connections(const List& rows);
  void ask_tokens();
  void ask_connections();
  void start_or_stop();
  void make_token();
  void hide_secret();
  void connect_remote();
  void send();
  /// Fails into the note of the panel and into messages.
  [[nodiscard]] Desk::Done noted(std::function<void(const Value&)> done);

  Desk& desk_;
  State state_;
  QTabWidget* pages_;
  QLabel *about_ = nullptr, *note_ = nullptr;
  QPushButton *start_ = nullptr, *kick_ = nullptr, *revoke_ = nullptr, *send_ = nullptr,
              *stop_ = nullptr;
  QLineEdit *address_ = nullptr, *certificate_ = nullptr, *key_ = nullptr;
  QCheckBox *needs_token_ = nullptr, *browser_ = nullptr;
  RightsRow *rights_ = nullptr, *token_rights_ = nullptr;
  QTreeWidget *clients_ = nullptr, *tokens_ = nullptr;
  QLineEdit *token_name_ = nullptr, *secret_ = nullptr;
  QComboBox* token_end_ = nullptr;
  QWidget* secret_row_ = nullptr;
  QLineEdit *remote_address_ = nullptr, *remote_token_ = nullptr, *line_ = nullptr;
  QComboBox* remotes_ = nullptr;
  QPlainTextEdit* answers_ = nullptr;
  std::vector<QWidget*> lines_;  ///< fields of one line, which stay short in a wide panel
  QStringList sent_;
  qsizetype at_ = 0;  ///< of sent_
  Desk::Answer calling_;
  QTimer timer_;  ///< follows the traffic while the panel is shown and a server runs
  int themed_ = theme_revision();
};

}  // namespace robomosp::viewer
