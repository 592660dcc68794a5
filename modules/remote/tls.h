// SPDX-License-Identifier: Apache-2.0
// TLS by OpenSSL, apart from sockets: bytes of the network in, bytes of the network out
// (layer: application, remote). No OpenSSL type shows here.
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include <robomosp/sdk/result.h>

namespace robomosp::remote {

/// What one end of connections needs for TLS 1.2 or later: a server its certificate and key, a
/// client whom it trusts. [any thread]
class TlsContext {
 public:
  /// PEM files: the certificate with its chain, and the private key, which only its owner may be
  /// able to read. ErrorCode::io or invalid_argument says which file is wrong and why.
  static Result<std::shared_ptr<TlsContext>> create(const std::filesystem::path& certificate,
                                                    const std::filesystem::path& key);
  /// Of a client. `trusted`: a PEM file of certificates; a server that shows one of them is trusted
  /// whatever its name, and what they signed by name. Empty = the authorities of the system.
  static Result<std::shared_ptr<TlsContext>> create_client(const std::filesystem::path& trusted);
  ~TlsContext();
  TlsContext(const TlsContext&) = delete;
  TlsContext& operator=(const TlsContext&) = delete;

 private:
  friend class TlsStream;
  TlsContext() = default;
  void* context_ = nullptr;     ///< SSL_CTX
  std::vector<void*> trusted_;  ///< X509, whatever their name
};

/// One end of a connection. [one thread at a time]
class TlsStream {
 public:
  /// The server's end.
  explicit TlsStream(std::shared_ptr<TlsContext> context);
  /// The client's end, which speaks first: its output() holds the beginning. `host` is the name or
  /// the address that the server must be certified for.
  TlsStream(std::shared_ptr<TlsContext> context, std::string host);
  ~TlsStream();
  TlsStream(const TlsStream&) = delete;
  TlsStream& operator=(const TlsStream&) = delete;

  /// Takes bytes of the network and gives what they say to `plain`, in pieces. An error ends the
  /// connection; output() may hold an alert then.
  Result<void> feed(std::string_view bytes, const std::function<void(std::string_view)>& plain);
  /// To be sent encrypted; false before the handshake is done, when nothing can be.
  bool write(std::string_view plain);
  /// Says to the peer that nothing follows.
  void close();
  /// Bytes for the network that wait; they are taken.
  [[nodiscard]] std::string output();
  [[nodiscard]] bool is_ready() const { return is_ready_; }
  [[nodiscard]] bool is_closed() const { return is_closed_; }  ///< by the peer

 private:
  [[nodiscard]] Result<void> check_server() const;
  std::shared_ptr<TlsContext> context_;
  std::string host_;     ///< of the server; "" = this is the server
  void* ssl_ = nullptr;  ///< SSL
  bool is_ready_ = false, is_closed_ = false;
};

}  // namespace robomosp::remote
