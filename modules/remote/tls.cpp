// SPDX-License-Identifier: Apache-2.0
#include "remote/tls.h"

#include <openssl/err.h>
#include <openssl/pem.h>
#include <openssl/ssl.h>
#include <openssl/x509v3.h>
#include <sys/stat.h>

#include <array>
#include <utility>

#include "kernel/text.h"

namespace robomosp::remote {
namespace {

/// What OpenSSL noted last, in its words; the queue is empty then.
std::string tls_reason() {
  std::array<char, 256> words{};
  const unsigned long code = ERR_get_error();
  ERR_clear_error();
  if (code == 0) return "the connection was closed meanwhile";
  if (const char* text = ERR_reason_error_string(code)) return text;
  ERR_error_string_n(code, words.data(), words.size());
  return words.data();
}

}  // namespace

Result<std::shared_ptr<TlsContext>> TlsContext::create(const std::filesystem::path& certificate,
                                                       const std::filesystem::path& key) {
  struct stat info {};
  if (::stat(certificate.c_str(), &info) != 0 || !S_ISREG(info.st_mode))
    return error(ErrorCode::io,
                 "the certificate " + text::quote(certificate.string()) + " cannot be read",
                 "Give a PEM file.");
  if (::stat(key.c_str(), &info) != 0 || !S_ISREG(info.st_mode))
    return error(ErrorCode::io, "the private key " + text::quote(key.string()) + " cannot be read",
                 "Give a PEM file.");
  if ((info.st_mode & (S_IRWXG | S_IRWXO)) != 0)
    return error(
        ErrorCode::permission,
        "the private key " + text::quote(key.string()) + " can be read by others than its owner",
        "Do: chmod 600 " + key.string());
  std::shared_ptr<TlsContext> out(new TlsContext);
  SSL_CTX* context = SSL_CTX_new(TLS_server_method());
  if (!context) return error(ErrorCode::internal, "OpenSSL: " + tls_reason());
  out->context_ = context;
  SSL_CTX_set_min_proto_version(context, TLS1_2_VERSION);
  SSL_CTX_set_options(
      context, SSL_OP_NO_COMPRESSION | SSL_OP_NO_RENEGOTIATION | SSL_OP_IGNORE_UNEXPECTED_EOF);
  // An idle connection keeps no buffers, and no session is kept for another one.
  SSL_CTX_set_mode(context, SSL_MODE_RELEASE_BUFFERS);
  SSL_CTX_set_session_cache_mode(context, SSL_SESS_CACHE_OFF);
  if (SSL_CTX_use_certificate_chain_file(context, certificate.c_str()) != 1)
    return error(
        ErrorCode::invalid_argument,
        "the certificate " + text::quote(certificate.string()) + " cannot be used: " + tls_reason(),
        "Give a PEM file with the certificate and its chain.");
  if (SSL_CTX_use_PrivateKey_file(context, key.c_str(), SSL_FILETYPE_PEM) != 1)
    return error(
        ErrorCode::invalid_argument,
        "the private key " + text::quote(key.string()) + " cannot be used: " + tls_reason(),
        "Give a PEM file without a password.");
  if (SSL_CTX_check_private_key(context) != 1)
    return error(ErrorCode::invalid_argument,
                 "the private key " + text::quote(key.string()) +
                     " is not that of the certificate: " + tls_reason());
  return out;
}

Result<std::shared_ptr<TlsContext>> TlsContext::create_client(
    const std::filesystem::path& trusted) {
  std::shared_ptr<TlsContext> out(new TlsContext);
  SSL_CTX* context = SSL_CTX_new(TLS_client_method());
  if (!context) return error(ErrorCode::internal, "OpenSSL: " + tls_reason());
  out->context_ = context;
  SSL_CTX_set_min_proto_version(context, TLS1_2_VERSION);
  SSL_CTX_set_options(
      context, SSL_OP_NO_COMPRESSION | SSL_OP_NO_RENEGOTIATION | SSL_OP_IGNORE_UNEXPECTED_EOF);
  // Whom it is looked at after the handshake, by check_server(), before a byte is sent.
  SSL_CTX_set_verify(context, SSL_VERIFY_NONE, nullptr);
  if (trusted.empty()) {
    SSL_CTX_set_default_verify_paths(context);
    return out;
  }
  const auto wrong = [&trusted](const std::string& why) {
    return error(ErrorCode::io,
                 "the certificate " + text::quote(trusted.string()) + " cannot be read: " + why,
                 "Give a PEM file.", "certificate");
  };
  BIO* file = BIO_new_file(trusted.c_str(), "r");
  if (!file) return wrong(tls_reason());
  X509_STORE* store = SSL_CTX_get_cert_store(context);
  while (X509* one = PEM_read_bio_X509(file, nullptr, nullptr, nullptr)) {
    X509_STORE_add_cert(store, one);
    out->trusted_.push_back(one);
  }
  BIO_free(file);
  ERR_clear_error();
  if (out->trusted_.empty()) return wrong("it contains no certificate");
  return out;
}

TlsContext::~TlsContext() {
  for (void* one : trusted_) X509_free(static_cast<X509*>(one));
  SSL_CTX_free(static_cast<SSL_CTX*>(context_));
}

TlsStream::TlsStream(std::shared_ptr<TlsContext> context) : context_(std::move(context)) {
  SSL* ssl = SSL_new(static_cast<SSL_CTX*>(context_->context_));
  ssl_ = ssl;
  if (!ssl) return;  // feed() says so
  SSL_set_bio(ssl, BIO_new(BIO_s_mem()), BIO_new(BIO_s_mem()));
  SSL_set_accept_state(ssl);
}

TlsStream::TlsStream(std::shared_ptr<TlsContext> context, std::string host)
    : context_(std::move(context)), host_(std::move(host)) {
  SSL* ssl = SSL_new(static_cast<SSL_CTX*>(context_->context_));
  ssl_ = ssl;
  if (!ssl) return;  // feed() says so
  SSL_set_bio(ssl, BIO_new(BIO_s_mem()), BIO_new(BIO_s_mem()));
  SSL_set_connect_state(ssl);
  SSL_set_hostflags(ssl, X509_CHECK_FLAG_NO_PARTIAL_WILDCARDS);
  if (X509_VERIFY_PARAM_set1_ip_asc(SSL_get0_param(ssl), host_.c_str()) != 1) {
    SSL_set_tlsext_host_name(ssl, host_.c_str());
    SSL_set1_host(ssl, host_.c_str());
  }
  ERR_clear_error();
  (void)SSL_do_handshake(ssl);
  ERR_clear_error();
}

/// Whether the server is who it should be.
Result<void> TlsStream::check_server() const {
  SSL* ssl = static_cast<SSL*>(ssl_);
  X509* shown = SSL_get0_peer_certificate(ssl);
  for (const void* one : context_->trusted_)
    if (shown && X509_cmp(shown, static_cast<const X509*>(one)) == 0) return {};
  const long found = shown ? SSL_get_verify_result(ssl) : X509_V_ERR_UNSPECIFIED;
  if (found == X509_V_OK) return {};
  return error(ErrorCode::permission,
               "the server " + text::quote(host_) +
                   " is not trusted: " + X509_verify_cert_error_string(found),
               "Give the server's certificate: certificate = \"server.pem\".");
}

TlsStream::~TlsStream() { SSL_free(static_cast<SSL*>(ssl_)); }

Result<void> TlsStream::feed(std::string_view bytes,
                             const std::function<void(std::string_view)>& plain) {
  SSL* ssl = static_cast<SSL*>(ssl_);
  if (!ssl) return error(ErrorCode::internal, "there is no memory for TLS");
  ERR_clear_error();
  static thread_local std::array<char, 16'384> piece;
  while (!bytes.empty()) {
    const int taken = BIO_write(SSL_get_rbio(ssl), bytes.data(),
                                static_cast<int>(std::min<std::size_t>(bytes.size(), 1U << 20)));
    if (taken <= 0) return error(ErrorCode::io, "TLS: " + tls_reason());
    bytes.remove_prefix(static_cast<std::size_t>(taken));
    if (!is_ready_) {
      const int done = SSL_do_handshake(ssl);
      if (done != 1) {
        const int why = SSL_get_error(ssl, done);
        if (why == SSL_ERROR_WANT_READ || why == SSL_ERROR_WANT_WRITE) continue;
        return error(ErrorCode::io, "the TLS handshake failed: " + tls_reason());
      }
      if (!host_.empty()) RMP_TRY(check_server());
      is_ready_ = true;
    }
    for (;;) {
      const int n = SSL_read(ssl, piece.data(), static_cast<int>(piece.size()));
      if (n > 0) {
        plain({piece.data(), static_cast<std::size_t>(n)});
        continue;
      }
      const int why = SSL_get_error(ssl, n);
      if (why == SSL_ERROR_WANT_READ || why == SSL_ERROR_WANT_WRITE) break;
      if (why == SSL_ERROR_ZERO_RETURN) {
        is_closed_ = true;
        return {};
      }
      return error(ErrorCode::io, "TLS: " + tls_reason());
    }
  }
  return {};
}

bool TlsStream::write(std::string_view plain) {
  if (!is_ready_) return false;
  SSL* ssl = static_cast<SSL*>(ssl_);
  ERR_clear_error();
  while (!plain.empty()) {
    const int n = SSL_write(ssl, plain.data(),
                            static_cast<int>(std::min<std::size_t>(plain.size(), 1U << 20)));
    if (n <= 0) return false;
    plain.remove_prefix(static_cast<std::size_t>(n));
  }
  return true;
}

void TlsStream::close() {
  if (is_ready_) (void)SSL_shutdown(static_cast<SSL*>(ssl_));
  ERR_clear_error();
}

std::string TlsStream::output() {
  if (!ssl_) return {};
  BIO* out = SSL_get_wbio(static_cast<SSL*>(ssl_));
  std::string bytes(BIO_ctrl_pending(out), '\0');
  if (!bytes.empty()) {
    const int n = BIO_read(out, bytes.data(), static_cast<int>(bytes.size()));
    bytes.resize(n > 0 ? static_cast<std::size_t>(n) : 0);
  }
  return bytes;
}

}  // namespace robomosp::remote
