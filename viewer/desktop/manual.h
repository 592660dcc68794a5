// SPDX-License-Identifier: GPL-3.0-or-later
// Manual: the installed pages of the documentation: chapters, commands, search (layer: GUI).
#pragma once

#include <filesystem>
#include <optional>
#include <vector>

#include <QString>
#include <QStringList>

namespace robomosp::viewer {

/// A heading of a page and the text below it, up to the next heading.
struct ManualSection {
  QString page;     ///< "user/desktop.md", or "command:robot.fk" for a command
  QString chapter;  ///< first heading of its file
  QString title;    ///< its heading
  QString anchor;   ///< "" at the beginning of a page and for commands
  QString text;     ///< Markdown without the heading
};

/// Reads the files of a folder, <share>/docs; nothing is kept before the first search. [GUI thread]
class Manual {
 public:
  /// The scripts are in folders beside it.
  explicit Manual(std::filesystem::path folder);

  [[nodiscard]] bool is_there() const;
  [[nodiscard]] const std::filesystem::path& folder() const { return folder_; }
  /// Markdown of a page such as "user/desktop.md"; none if there is no such file in the folder.
  [[nodiscard]] std::optional<QString> read(const QString& page) const;
  /// Markdown of the page of a command; none if the pages do not have it.
  [[nodiscard]] std::optional<QString> command(const QString& name) const;
  /// Pages of a folder such as "user", sorted by name.
  [[nodiscard]] QStringList pages(const QString& folder) const;
  /// Scripts of the program that can be run: examples, then demonstrations.
  struct Script {
    QString file;   ///< with its folder
    QString title;  ///< its first comment
  };
  [[nodiscard]] std::vector<Script> scripts() const;
  /// Their files, which are not read.
  [[nodiscard]] QStringList script_files() const;
  /// First heading of a page, or its name.
  [[nodiscard]] QString title(const QString& page) const;
  /// Sections that contain all words, best first: names and headings before texts.
  [[nodiscard]] std::vector<const ManualSection*> search(const QString& words,
                                                         std::size_t at_most) const;
  /// Name of the anchor of a heading, as in links between pages.
  [[nodiscard]] static QString anchor_of(const QString& heading);

 private:
  const std::vector<ManualSection>& sections() const;
  std::filesystem::path folder_;
  std::filesystem::path share_;  ///< has the scripts
  mutable std::vector<ManualSection> sections_;
  mutable bool is_read_ = false;
};

/// Text around the first of the words in a section, on one line.
[[nodiscard]] QString excerpt_of(const ManualSection& section, const QString& words);

}  // namespace robomosp::viewer
