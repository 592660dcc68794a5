// SPDX-License-Identifier: Apache-2.0
// Programs of robots: their source, line by line (layer: data processing, model).
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "model/basics.h"

namespace robomosp::model {

/// A file of a program's source. Lines joined by "\n" are its text.
struct ProgramFile {
  std::string name;  ///< without folders: "towers.irl"
  std::vector<std::string> lines;
};
template <class V>
constexpr void fields(V& v, Of<ProgramFile>) {
  v("name", &ProgramFile::name).needed().doc("Name of the file, without folders.");
  v("lines", &ProgramFile::lines).file("line").doc("Its text, line by line.");
}

struct Program {
  std::string description;
  std::string language;             ///< the provider; "" = the default one
  std::vector<ProgramFile> files;   ///< the program first, then cells, modules, lists of data
  std::string target_profile = {};  ///< of the controller that it is posted for; "" = none
};
template <class V>
constexpr void fields(V& v, Of<Program>) {
  v("description", &Program::description).doc("Its description.");
  v("language", &Program::language).doc("Provider of its language; empty is the default one.");
  v("files", &Program::files)
      .by_names()
      .doc("Its source: the program first, then the files it names: cell, modules, lists of data.");
  v("target_profile", &Program::target_profile)
      .doc("Profile of the controller that it is posted for; empty is none.");
}

}  // namespace robomosp::model
