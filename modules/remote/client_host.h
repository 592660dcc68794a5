// SPDX-License-Identifier: Apache-2.0
// ClientHost: gives a Lua state of this program access to the commands of a server (layer:
// application, remote).
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "ioci/core/command.h"
#include "lua/listed_commands.h"
#include "remote/client.h"

namespace robomosp::remote {

/// Scripts run here and their commands on the server, with the rights of the connection. If the
/// connection is lost, the next command reconnects. [one thread]
class ClientHost final : public lua::ListedCommands {
 public:
  using Warn = std::function<void(const std::string& sentence)>;
  /// Reads the command table, and subscribes to warnings. `user` can interrupt waiting.
  static Result<std::unique_ptr<ClientHost>> make(std::unique_ptr<Client> client,
                                                  ioci::Session& user, Warn warn);

  [[nodiscard]] Error unknown(std::string_view name) const override;
  Result<Value> dispatch(const ioci::CommandSpec&, const Map& args) override;
  Result<Handle> dispatch_async(const ioci::CommandSpec&, Map args) override;
  Result<Value> dispatch_classic(std::string_view line) override;
  Result<void> transaction(const std::string& label,
                           const std::function<Result<void>()>& body) override;
  [[nodiscard]] std::optional<std::string> name_of(const Handle&) const override;
  [[nodiscard]] std::string describe(const Handle&) const override;
  [[nodiscard]] bool interrupted() const override { return user_.interrupted(); }
  void clear_interrupt() override { user_.clear_interrupt(); }
  [[nodiscard]] Result<void> may(Effect, std::string_view what) const override;
  void warn(std::string_view code, const std::string& sentence) override;

  /// Notes caused by this console's commands since the last call.
  [[nodiscard]] std::vector<Client::Note> take_notes() { return client_->take_notes(); }
  /// Prints the warnings received since the last call.
  void tell_warnings();
  [[nodiscard]] const Client& client() const { return *client_; }

 private:
  ClientHost(std::unique_ptr<Client> client, ioci::Session& user, Warn warn)
      : client_(std::move(client)), user_(user), warn_(std::move(warn)) {}
  /// After hello: the table, and the subscription.
  Result<void> begin();
  Result<Value> ask(const std::string& method, Value params, bool as_job);
  /// Converts handles to tables, and back.
  [[nodiscard]] Value sent(const Value& value) const;
  [[nodiscard]] Value came(const Value& value);

  /// Facts about a handle.
  struct Known {
    std::string name;
    std::int64_t generation = 0;  ///< of the connection
  };
  std::unique_ptr<Client> client_;
  ioci::Session& user_;
  const Warn warn_;
  std::map<std::pair<std::string, std::uint64_t>, Known> handles_;
};

}  // namespace robomosp::remote
