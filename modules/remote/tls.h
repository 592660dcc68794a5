// SPDX-License-Identifier: Apache-2.0
// TLS by OpenSSL, independent of sockets: network bytes in, network bytes out (layer: application,
// remote). No OpenSSL types in this header.
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include <robomosp/sdk/result.h>

namespace robomosp::remote {

/// Settings of one end of connections, TLS 1.2 or later: a server's certificate and key, or a
/// client's trusted certificates. [any thread]
class TlsContext {
 public:
  /// PEM files: the certificate with its chain, and the private key, which must be readable by its
  /// owner only. ErrorCode::io or invalid_argument with the file and the reason.
  static Result<std::shared_ptr<TlsContext>> create(const std::filesystem::path& certificate,
                                                    const std::filesystem::path& key);
  /// For a client. `trusted`: a PEM file of certificates; a server with one of them is trusted
  /// whatever its name, and certificates signed by them are checked by name. Empty = the system's
  /// authorities.
  static Result<std::shared_ptr<TlsContext>> create_client(const std::filesystem::path& trusted);
  ~TlsContext();
  TlsContext(const TlsContext&) = delete;
  TlsContext& operator=(const TlsContext&) = delete;

 private:
  friend class TlsStream;
  TlsContext() = default;
  void* context_ = nullptr;     ///< SSL_CTX
  std::vector<void*> trusted_;  ///< X509, trusted whatever their name
};

/// One end of a connection. [one thread at a time]
class TlsStream {
 public:
  /// The server's end.
  explicit TlsStream(std::shared_ptr<TlsContext> context);
  /// The client's end, which sends first: output() returns its first bytes. `host` is the name or
  /// address for which the server must be certified.
  TlsStream(std::shared_ptr<TlsContext> context, std::string host);
  ~TlsStream();
  TlsStream(const TlsStream&) = delete;
  TlsStream& operator=(const TlsStream&) = delete;

  /// Processes network bytes and passes decrypted data to `plain`, in pieces. An error ends the
  /// connection; output() may then contain an alert.
  Result<void> feed(std::string_view bytes, const std::function<void(std::string_view)>& plain);
  /// Encrypts data for sending; false before the handshake is complete.
  bool write(std::string_view plain);
  /// Notifies the peer of the end.
  void close();
  /// Returns and clears the bytes to send.
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
