// SPDX-License-Identifier: Apache-2.0
#include "kernel/number_reader.h"

#include <utility>

namespace robomosp {
namespace {

thread_local NumberReader* t_number_reader = nullptr;

}  // namespace

NumberReader* NumberReader::current() noexcept { return t_number_reader; }

NumberReader::Scope::Scope(NumberReader* reader) noexcept
    : before_(std::exchange(t_number_reader, reader)) {}
NumberReader::Scope::~Scope() { t_number_reader = before_; }

}  // namespace robomosp
