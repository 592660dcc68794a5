// SPDX-License-Identifier: Apache-2.0
// One call of a function or procedure of the language while it runs (layer: data processing,
// program only).
#pragma once

#include <array>
#include <string>

#include "program/state.h"

namespace robomosp::program {

struct Run::Intrinsic {
  Run& run;
  Process& p;
  const IntrinsicCall& c;
  std::array<const Slot*, 4> in{};  ///< the first arguments

  /// Asks the handler of its kind; arguments are read there.
  Did call();

  Did failed(std::string message, std::string hint = {});
  Did unknown();
  /// As the source writes it.
  [[nodiscard]] std::string name() const;
  [[nodiscard]] Slot* out() { return run.slots(p, c.result); }
  [[nodiscard]] double number(std::size_t k) const { return in[k]->real(); }
  /// Results: an INT, and n REALs; outside their ranges it is a fault.
  Did whole(std::int64_t v);
  Did reals(const double* v, std::size_t n);
  /// The n numbers of an argument.
  void get(std::size_t k, double* v, std::size_t n) const;
  /// An orientation as a rotation, so of length one; false = a fault.
  bool turned(std::size_t k, double* q);

  Did numbers();               ///< functions of numbers, SIZE, and the step of a FOR
  Did geometry();              ///< vectors and poses
  Did orientations();          ///< orientations made of numbers
  Did parts_of_orientation();  ///< angles, axes and components of an orientation
  Did texts();                 ///< strings
  Did lists();                 ///< lists
  Did robots();                ///< what the world knows of robots
  Did files();                 ///< files and the screen
  Did semaphores();            ///< semaphores and states of processes
};

}  // namespace robomosp::program
