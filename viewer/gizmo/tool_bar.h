// SPDX-License-Identifier: GPL-3.0-or-later
// The buttons of a view's bar that choose its tool, and the menus behind them (layer: GUI).
#pragma once

class QMenu;
class QToolBar;

namespace robomosp::viewer {

class Actions;
class Desk;
class MainWindow;

/// Adds the entries of all tools to a menu, once for the window.
void add_tool_actions(MainWindow& window, Actions& actions, QMenu& menu);
/// Adds select, move, turn, magnet, axes and measure to the bar of a view.
void add_tool_buttons(Desk& desk, const Actions& actions, QToolBar& bar);

}  // namespace robomosp::viewer
