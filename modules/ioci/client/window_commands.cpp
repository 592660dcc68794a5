// SPDX-License-Identifier: Apache-2.0
// Commands that drive the window of the desktop: open a panel, click, type, read, photograph.
// Tests, the manual's pictures and macros use them.
#include <utility>

#include "io/native.h"
#include "ioci/client/window_host.h"
#include "ioci/core/commands.h"
#include "kernel/permit.h"

namespace robomosp::ioci {

Windows& Windows::of(Application& app) { return app.kept<Windows>(); }

void Windows::set(std::shared_ptr<WindowHost> host) {
  const std::lock_guard lock(mutex_);
  host_.swap(host);
}

std::shared_ptr<WindowHost> Windows::current() const {
  const std::lock_guard lock(mutex_);
  return host_;
}

namespace {

Result<Value> is_open(CommandContext& ctx, const Map&) {
  return Value(Windows::of(ctx.app).current() != nullptr);
}

Result<Value> act_in_window(CommandContext& ctx, std::string_view what, const Map& args) {
  const std::shared_ptr<WindowHost> host = Windows::of(ctx.app).current();
  if (!host)
    return error(ErrorCode::not_found, "no window is open",
                 "Start robomosp-desktop, and call the command in its console or a script of it.");
  return host->act(what, args, ctx.progress);
}

Result<Value> list_actions(CommandContext& ctx, const Map& args) {
  return act_in_window(ctx, "actions", args);
}
Result<Value> trigger(CommandContext& ctx, const Map& args) {
  return act_in_window(ctx, "trigger", args);
}
Result<Value> open(CommandContext& ctx, const Map& args) {
  if (has(args, "panel") == has(args, "record"))
    return error(ErrorCode::invalid_argument, "give either a panel or a record",
                 "Panels are listed by window.widgets{}.");
  return act_in_window(ctx, "open", args);
}
Result<Value> set(CommandContext& ctx, const Map& args) { return act_in_window(ctx, "set", args); }
Result<Value> set_keys(CommandContext& ctx, const Map& args) {
  if (has(args, "keys") && !has(args, "action"))
    return error(ErrorCode::invalid_argument, "no entry of the menus is named for the keys",
                 "Give its name as action; window.actions{} lists them.", "action");
  return act_in_window(ctx, "set_keys", args);
}
Result<Value> widgets(CommandContext& ctx, const Map& args) {
  return act_in_window(ctx, "widgets", args);
}
Result<Value> click(CommandContext& ctx, const Map& args) {
  return act_in_window(ctx, "click", args);
}
Result<Value> drag(CommandContext& ctx, const Map& args) {
  return act_in_window(ctx, "drag", args);
}
Result<Value> type(CommandContext& ctx, const Map& args) {
  if (!has(args, "text") && !has(args, "keys"))
    return error(ErrorCode::invalid_argument, "give a text or keys", "Such as keys = \"Ctrl+Z\".");
  return act_in_window(ctx, "type", args);
}
Result<Value> read(CommandContext& ctx, const Map& args) {
  return act_in_window(ctx, "read", args);
}
Result<Value> select(CommandContext& ctx, const Map& args) {
  return act_in_window(ctx, "select", args);
}
Result<Value> show_member(CommandContext& ctx, const Map& args) {
  return act_in_window(ctx, "show_member", args);
}
Result<Value> fade_member(CommandContext& ctx, const Map& args) {
  return act_in_window(ctx, "fade_member", args);
}
Result<Value> settle(CommandContext& ctx, const Map& args) {
  return act_in_window(ctx, "settle", args);
}
Result<Value> photograph(CommandContext& ctx, const Map& args) {
  RMP_TRY(require(Effect::files_write));
  RMP_TRY_ASSIGN(const Value png, act_in_window(ctx, "photograph", args));
  if (png.as_string() == nullptr)
    return error(ErrorCode::internal, "the window returned no picture", "Report this.");
  const std::string file = text_of(args, "file");
  RMP_TRY(io::write_file(file, *png.as_string()));
  return Value(file);
}

ParamSpec widget_field() {
  return needed("widget", "string", "",
                "Object name of the widget, as window.widgets lists it. If several have the name, "
                "the names of those around it come first: \"console/input\".");
}
ParamSpec keys_field() {
  return optional("keys", "string", "", "Keys held meanwhile, such as \"Ctrl+Shift\".");
}
ParamSpec button_field() {
  return choice("button", {"left", "middle", "right"}, "Button of the mouse.");
}
/// Lua that calls a command where there is no window, and checks the refusal.
std::string refused(const std::string& command, const std::string& arguments) {
  return "local ok, e = pcall(" + command + ", {" + arguments + "})\n" +
         "assert(ok == window.is_open())";
}

}  // namespace

RMP_COMMANDS(window_commands) {
  /// Whoever may use the window may do all that its user may.
  constexpr Effects kDrives = Effects::all();
  std::vector<CommandSpec> all;
  all.push_back({.name = "window.is_open",
                 .classic = "",
                 .summary = "Reports whether this program has a window.",
                 .details = "",
                 .example = "assert(window.is_open() == false or window.is_open() == true)",
                 .params = {},
                 .returns = {"bool", "", "True in robomosp-desktop while its window is open.", {}},
                 .effect = Effect::reads,
                 .run = is_open});
  all.push_back({.name = "window.actions",
                 .classic = "",
                 .summary = "Lists the entries of the window's menus.",
                 .details = "",
                 .example = refused("window.actions", ""),
                 .params = {},
                 .returns = {"list",
                             "",
                             "",
                             {field("name", "string", "", "Name, for window.trigger."),
                              field("text", "string", "", "Its text."),
                              field("keys", "string", "", "Its shortcut, empty if it has none."),
                              field("command", "string", "", "The command that it calls."),
                              field("is_enabled", "bool", "", "Whether it can be triggered now."),
                              field("is_checked", "bool", "", "Whether it is switched on.")}},
                 .effect = Effect::administers,
                 .run = list_actions});
  all.push_back(
      {.name = "window.trigger",
       .classic = "",
       .summary = "Triggers an entry of the window's menus.",
       .details = "What the entry starts may continue after this: window.settle waits.",
       .example = refused("window.trigger", "action = \"view_reset_layout\""),
       .params = {needed("action", "string", "", "Its name, as window.actions lists it.")},
       .returns = {},
       .effect = kDrives,
       .run = trigger});
  all.push_back(
      {.name = "window.open",
       .classic = "",
       .summary = "Shows a panel of the window, or a record in a tab.",
       .details = "Panels are navigator, properties, console, messages, jobs, timeline, help, "
                  "connections, shortcuts and start. A world, "
                  "robot, object or solid gets a tab with its picture.",
       .example = refused("window.open", "panel = \"console\""),
       .params = {optional("panel", "string", "", "Name of the panel."),
                  optional("page", "string", "",
                           "With the panel help: its page, such as \"user/desktop.md\", "
                           "\"command:robot.fk\", \"topic:robot\", \"search:torque\" or "
                           "\"contents\"."),
                  optional(
                      "record", "ref:world|robot|object|solid|recording|run", "",
                      "The record to show; a recording or live run in the tab of what it moves.")},
       .returns = {},
       .effect = kDrives,
       .run = open});
  all.push_back(
      {.name = "window.set",
       .classic = "",
       .summary = "Sets the workspace, theme, zoom or size of the window.",
       .details = "",
       .example = refused("window.set", "theme = \"dark\""),
       .params = {optional("workspace", "enum(model|robot|motion|program)", "", "The workspace."),
                  optional("theme", "enum(dark|light)", "", "The theme."),
                  between(optional("zoom", "real", "", "Zoom of the interface, 1 is normal."), 0.5,
                          3),
                  optional("size", "vec(width, height)", "",
                           "Size of the window [device-independent px].")},
       .returns = {"map",
                   "",
                   "",
                   {field("workspace", "string", "", "The present workspace."),
                    field("theme", "string", "", "The present theme."),
                    field("zoom", "real", "", "The present zoom."),
                    field("size", "vec(width, height)", "", "The present size.")}},
       .effect = kDrives,
       .run = set});
  all.push_back(
      {.name = "window.set_keys",
       .classic = "",
       .summary = "Sets the shortcut of an entry of the window's menus.",
       .details =
           "It is kept in the user's settings. Without keys the entry gets back the shortcut "
           "that the program gives it; without an entry all get theirs back.",
       .example = refused("window.set_keys", ""),
       .params = {optional("action", "string", "", "Its name, as window.actions lists it."),
                  optional("keys", "string", "",
                           "Such as \"Ctrl+Shift+K\"; empty for none. Keys of another entry are "
                           "refused.")},
       .returns = {},
       .effect = kDrives,
       .run = set_keys});
  all.push_back(
      {.name = "window.widgets",
       .classic = "",
       .summary = "Lists the widgets of the window.",
       .details = "Widgets without an object name are left out.",
       .example = refused("window.widgets", ""),
       .params = {optional("inside", "string", "", "Only those inside this widget."),
                  defaulted("hidden", "bool", "", false, "Lists also those that are not visible.")},
       .returns = {"list",
                   "",
                   "",
                   {field("widget", "string", "", "Object name."),
                    field("inside", "string", "", "Object name of what is around it."),
                    field("class", "string", "", "Its class."),
                    field("name", "string", "", "Its accessible name."),
                    field("tip", "string", "", "Its tool tip."),
                    field("place", "vec(x, y, width, height)", "",
                          "Its place in the window [device-independent px]."),
                    field("is_visible", "bool", "", "Whether it is visible."),
                    field("is_enabled", "bool", "", "Whether it can be used.")}},
       .effect = Effect::administers,
       .run = widgets});
  all.push_back({.name = "window.click",
                 .classic = "",
                 .summary = "Clicks a widget of the window with the mouse.",
                 .details = "",
                 .example = refused("window.click", "widget = \"status_theme\""),
                 .params = {widget_field(),
                            optional("at", "vec(x, y)", "",
                                     "Place in the widget [device-independent px]; by default its "
                                     "middle."),
                            optional("row", "string", "",
                                     "Of a tree or list: the row with this text, instead of `at`."),
                            button_field(),
                            defaulted("twice", "bool", "", false, "A double click."), keys_field()},
                 .returns = {},
                 .effect = kDrives,
                 .run = click});
  all.push_back(
      {.name = "window.drag",
       .classic = "",
       .summary = "Drags the mouse in a widget of the window.",
       .details = "",
       .example =
           refused("window.drag", "widget = \"display\", from = {200, 200}, to = {260, 200}"),
       .params = {widget_field(), needed("from", "vec(x, y)", "", "Start in the widget [px]."),
                  needed("to", "vec(x, y)", "", "End in the widget [px]."), button_field(),
                  keys_field()},
       .returns = {},
       .effect = kDrives,
       .run = drag});
  all.push_back({.name = "window.type",
                 .classic = "",
                 .summary = "Types into a widget of the window.",
                 .details = "The widget gets the focus.",
                 .example = refused("window.type",
                                    "widget = \"console_input\", text = \"1 + 1\", "
                                    "keys = \"Return\""),
                 .params = {widget_field(), optional("text", "string", "", "Text to type."),
                            optional("keys", "string", "",
                                     "Keys to press after the text, such as \"Ctrl+A\" or \"Down, "
                                     "Return\".")},
                 .returns = {},
                 .effect = kDrives,
                 .run = type});
  all.push_back({.name = "window.read",
                 .classic = "",
                 .summary = "Returns what a widget of the window shows.",
                 .details = "",
                 .example = refused("window.read", "widget = \"status_selection\""),
                 .params = {widget_field()},
                 .returns = {"map",
                             "",
                             "",
                             {field("text", "string", "", "Its text."),
                              field("is_checked", "bool", "", "Of what can be checked."),
                              field("is_enabled", "bool", "", "Whether it can be used."),
                              field("is_visible", "bool", "", "Whether it is visible."),
                              field("has_focus", "bool", "", "Whether keys go to it."),
                              field("value", "real", "", "Of sliders and progress bars."),
                              field("rows", "list<list<string>>", "",
                                    "Of trees, lists and tables: the visible texts row by row.")}},
                 .effect = Effect::administers,
                 .run = read});
  all.push_back(
      {.name = "window.select",
       .classic = "",
       .summary = "Selects a record or a part of it in the window.",
       .details = "",
       .example = refused("window.select", ""),
       .params = {optional("record", "ref:any", "", "The record; none clears."),
                  optional("path", "string", "", "The part, as record.outline names it.")},
       .returns = {},
       .effect = kDrives,
       .run = select});
  all.push_back(
      {.name = "window.show_member",
       .classic = "",
       .summary = "Shows or hides a member of a world in its view.",
       .details =
           "The world is not changed: other views show the member as before, and so do pictures "
           "that are not saved from this one.",
       .example = "world.create{name = \"cell\"}\n"
                  "-- Refused without a view of the world.\n"
                  "assert(not pcall(window.show_member, {record = \"cell\", member = "
                  "\"objects.table\"}))",
       .params = {needed("record", "ref:world", "", "The world, which has a view."),
                  needed("member", "string", "", "The member, such as \"objects.table\"."),
                  defaulted("shown", "bool", "", true, "False hides it.")},
       .returns = {},
       .effect = kDrives,
       .run = show_member});
  all.push_back(
      {.name = "window.fade_member",
       .classic = "",
       .summary = "Draws a member of a world, or a part of a record, transparent in a view.",
       .details =
           "The current view if it draws the part, else the first one that does. The record is not "
           "changed: other views draw it as before, and so do pictures that are not saved from "
           "this "
           "one. window.show_member{shown = false} "
           "hides it.",
       .example = "world.create{name = \"cell\"}\n"
                  "-- Refused without a view of the world.\n"
                  "assert(not pcall(window.fade_member, {record = \"cell\", member = "
                  "\"objects.table\", opacity = 0.3}))",
       .params = {needed("record", "ref:world|robot|object|solid", "", "The record."),
                  optional("member", "string", "",
                           "Its member, link, part or node, such as \"objects.table\" or "
                           "\"links.forearm\"; omitted, all that is shown of the record."),
                  between(
                      needed("opacity", "real", "",
                             "Share of the opacity that the record gives; 1 draws it as given."),
                      0.02, 1)},
       .returns = {},
       .effect = kDrives,
       .run = fade_member});
  all.push_back(
      {.name = "window.settle",
       .classic = "",
       .summary = "Waits until the window has shown all that was asked.",
       .details = "That is: no call of the window waits, and its picture is exact.",
       .example = refused("window.settle", ""),
       .params = {between(defaulted("at_most", "real", "s", 30.0, "Longest wait."), 0, 3600)},
       .returns = {"bool", "", "False if the time was over before.", {}},
       .effect = Effect::administers,
       .run = settle});
  all.push_back({.name = "window.photograph",
                 .classic = "",
                 .summary = "Saves a picture of the window or of a widget as a PNG file.",
                 .details = "It waits as window.settle does.",
                 .example = refused("window.photograph", "file = \"window.png\""),
                 .params = {needed("file", "path(save: *.png)", "", "The picture."),
                            optional("widget", "string", "", "Only this widget.")},
                 .returns = {"path", "", "The file.", {}},
                 .effect = Effect::administers | Effect::files_write,
                 .run = photograph});
  return all;
}

}  // namespace robomosp::ioci
