// SPDX-License-Identifier: Apache-2.0
// TLS by OpenSSL, apart from sockets: bytes of the network in, bytes of the network out
// (layer: application, remote). No OpenSSL type shows here.
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <string_view>

#include <robomosp/sdk/result.h>

namespace robomosp::remote {

/// A server's certificate and key, TLS 1.2 or later. [any thread]
class TlsContext {
 public:
  /// PEM files: the certificate with its chain, and the private key, which only its owner may be
  /// able to read. ErrorCode::io or invalid_argument says which file is wrong and why.
  static Result<std::shared_ptr<TlsContext>> create(const std::filesystem::path& certificate,
                                                    const std::filesystem::path& key);
  ~TlsContext();
  TlsContext(const TlsContext&) = delete;
  TlsContext& operator=(const TlsContext&) = delete;

 private:
  friend class TlsStream;
  TlsContext() = default;
  void* context_ = nullptr;  ///< SSL_CTX
};

/// The server's end of one connection. [one thread at a time]
class TlsStream {
 public:
  explicit TlsStream(std::shared_ptr<TlsContext> context);
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
  std::shared_ptr<TlsContext> context_;
  void* ssl_ = nullptr;  ///< SSL
  bool is_ready_ = false, is_closed_ = false;
};

}  // namespace robomosp::remote
