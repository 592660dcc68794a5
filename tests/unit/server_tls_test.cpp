// SPDX-License-Identifier: Apache-2.0
// TLS at the server's door: a certificate made for the test, a client of OpenSSL over a socket, and
// records that no client sends.
#include <sys/stat.h>

#include <cstdio>
#include <cstdlib>
#include <iostream>
#include <random>

#include <openssl/err.h>
#include <openssl/evp.h>
#include <openssl/pem.h>
#include <openssl/ssl.h>
#include <openssl/x509.h>

#include "support/seed.h"
#include "support/served.h"

namespace robomosp::remote {
namespace {

/// A certificate that signs itself, and its key, as files that only their owner reads.
void make_certificate(const fs::path& certificate, const fs::path& key) {
  const std::unique_ptr<EVP_PKEY, void (*)(EVP_PKEY*)> pair(EVP_EC_gen("P-256"), EVP_PKEY_free);
  ASSERT_TRUE(pair);
  const std::unique_ptr<X509, void (*)(X509*)> made(X509_new(), X509_free);
  X509_set_version(made.get(), 2);
  ASN1_INTEGER_set(X509_get_serialNumber(made.get()), 1);
  X509_gmtime_adj(X509_getm_notBefore(made.get()), -60);
  X509_gmtime_adj(X509_getm_notAfter(made.get()), 3600);
  X509_set_pubkey(made.get(), pair.get());
  X509_NAME* name = X509_get_subject_name(made.get());
  X509_NAME_add_entry_by_txt(name, "CN", MBSTRING_ASC,
                             reinterpret_cast<const unsigned char*>("localhost"), -1, -1, 0);
  X509_set_issuer_name(made.get(), name);
  ASSERT_GT(X509_sign(made.get(), pair.get(), EVP_sha256()), 0);
  const auto write = [](const fs::path& file, const auto& put) {
    std::FILE* out = std::fopen(file.c_str(), "w");
    ASSERT_TRUE(out);
    ::fchmod(::fileno(out), 0600);
    EXPECT_TRUE(put(out));
    std::fclose(out);
  };
  write(certificate, [&](std::FILE* f) { return PEM_write_X509(f, made.get()); });
  write(key, [&](std::FILE* f) {
    return PEM_write_PrivateKey(f, pair.get(), nullptr, nullptr, 0, nullptr, nullptr);
  });
}

/// The client's end, whose bytes the test carries.
class Tls {
 public:
  explicit Tls(int newest = 0) : context_(SSL_CTX_new(TLS_client_method())) {
    if (newest) {
      SSL_CTX_set_min_proto_version(context_, 0);
      SSL_CTX_set_max_proto_version(context_, newest);
      SSL_CTX_set_security_level(context_, 0);
    }
    ssl_ = SSL_new(context_);
    in_ = BIO_new(BIO_s_mem());
    out_ = BIO_new(BIO_s_mem());
    BIO_set_mem_eof_return(in_, -1);
    SSL_set_bio(ssl_, in_, out_);
    SSL_set_connect_state(ssl_);
    SSL_do_handshake(ssl_);
  }
  ~Tls() {
    SSL_free(ssl_);
    SSL_CTX_free(context_);
    ERR_clear_error();
  }
  Tls(const Tls&) = delete;
  Tls& operator=(const Tls&) = delete;
  /// What is to be sent.
  std::string output() {
    std::string out(BIO_ctrl_pending(out_), '\0');
    if (!out.empty()) BIO_read(out_, out.data(), static_cast<int>(out.size()));
    return out;
  }
  /// Takes what came, and gives what it says.
  std::string take(std::string_view bytes) {
    BIO_write(in_, bytes.data(), static_cast<int>(bytes.size()));
    std::string plain;
    for (char piece[4096];;) {
      const int n = SSL_read(ssl_, piece, sizeof piece);
      if (n <= 0) break;
      plain.append(piece, static_cast<std::size_t>(n));
    }
    ERR_clear_error();
    return plain;
  }
  bool say(std::string_view plain) {
    const bool is_said = SSL_write(ssl_, plain.data(), static_cast<int>(plain.size())) > 0;
    ERR_clear_error();
    return is_said;
  }
  [[nodiscard]] bool is_ready() const { return SSL_is_init_finished(ssl_) == 1; }
  [[nodiscard]] std::string version() const { return SSL_get_version(ssl_); }

 private:
  SSL_CTX* context_;
  SSL* ssl_ = nullptr;
  BIO *in_ = nullptr, *out_ = nullptr;
};

class ServerTlsTest : public ServerTest {
 protected:
  void SetUp() override {
    ServerTest::SetUp();
    options_.certificate = folder() / "certificate.pem";
    options_.key = folder() / "key.pem";
    make_certificate(options_.certificate, options_.key);
    options_.tls_everywhere = true;
    options_.limits.hello_seconds = 2;
    start();
  }
  /// Shakes hands.
  static bool shake(Client& c, Tls& tls) {
    for (int i = 0; i < 10 && !tls.is_ready(); ++i) {
      if (!c.send(tls.output())) return false;
      const std::string bytes = c.bytes(5s);
      if (bytes.empty()) return false;
      (void)tls.take(bytes);
    }
    return tls.is_ready();
  }
  static std::string line(Client& c, Tls& tls) {
    std::string plain;
    while (plain.find('\n') == std::string::npos) {
      const std::string bytes = c.bytes(5s);
      if (bytes.empty()) break;
      plain += tls.take(bytes);
    }
    return plain;
  }
  static constexpr std::string_view kHello =
      R"({"jsonrpc":"2.0","id":1,"method":"server.hello","params":{"protocol":1}})"
      "\n";
};

TEST_F(ServerTlsTest, AClientThatSpeaksItIsServedAndOthersAreCut) {
  {
    Client c(where());
    Tls tls;
    ASSERT_TRUE(shake(c, tls));
    EXPECT_TRUE(tls.version() == "TLSv1.3" || tls.version() == "TLSv1.2") << tls.version();
    ASSERT_TRUE(tls.say(kHello));
    ASSERT_TRUE(c.send(tls.output()));
    EXPECT_NE(line(c, tls).find(R"("program":"robomosp")"), std::string::npos);
    // Bytes that are no record end it.
    ASSERT_TRUE(c.send("not a record at all, but text"));
    for (int i = 0; i < 10 && !c.bytes(5s).empty(); ++i) {
    }
    EXPECT_TRUE(c.is_closed(5s));
  }
  {
    Client c(where());
    ASSERT_TRUE(c.send(kHello));  // without TLS
    const std::string said = c.bytes(5s);
    EXPECT_EQ(said.find("robomosp"), std::string::npos) << said;
    EXPECT_TRUE(c.is_closed(5s));
  }
  {
    Client c(where());
    Tls old(TLS1_1_VERSION);
    EXPECT_FALSE(shake(c, old)) << "1.1 is too old";
  }
  // One that stays silent within the handshake is cut as any that says no hello.
  Client c(where());
  Tls tls;
  const std::string first = tls.output();
  ASSERT_TRUE(c.send(first.substr(0, first.size() / 2)));
  EXPECT_TRUE(c.is_closed(10s));
}

TEST_F(ServerTlsTest, WhateverRecordsComeTheServerGoesOn) {
  std::mt19937 random(test::seed());
  const char* wish = std::getenv("ROBOMOSP_FUZZ_SECONDS");
  const auto until = Clock::now() + std::chrono::milliseconds(wish ? std::atoi(wish) * 1000 : 1500);
  std::size_t sent = 0, shaken = 0;
  const auto changed = [&](std::string bytes) {
    for (std::size_t k = random() % 4; k > 0 && !bytes.empty(); --k) {
      const std::size_t at = random() % bytes.size();
      switch (random() % 5) {
        case 0: bytes[at] = static_cast<char>(random()); break;
        case 1: bytes.erase(at, random() % 20); break;
        case 2: bytes.insert(at, bytes.substr(random() % bytes.size(), random() % 300)); break;
        case 3:
          bytes.insert(at, std::string(random() % 70'000, static_cast<char>(random())));
          break;
        default: bytes += "\x17\x03\x03\xff\xff" + std::string(random() % 3000, 'x'); break;
      }
    }
    return bytes;
  };
  while (Clock::now() < until) {
    Client c(where());
    Tls tls;
    std::string bytes;
    if (random() % 3 == 0) {  // the handshake itself
      bytes = changed(tls.output());
    } else {
      if (!shake(c, tls)) continue;
      ++shaken;
      for (std::size_t n = random() % 6; n > 0; --n)
        (void)tls.say(random() % 2 ? std::string(kHello) : std::string(random() % 20'000, '{'));
      bytes = changed(tls.output());
    }
    if (c.send(bytes)) sent += bytes.size();
    if (random() % 4 == 0) (void)c.bytes(2ms);
  }
  std::cout << sent << " bytes, " << shaken << " handshakes\n";
  EXPECT_GT(shaken, 10U);
  Client c(where());
  Tls tls;
  ASSERT_TRUE(shake(c, tls));
  ASSERT_TRUE(tls.say(kHello));
  ASSERT_TRUE(c.send(tls.output()));
  EXPECT_NE(line(c, tls).find(R"("result")"), std::string::npos);
}

}  // namespace
}  // namespace robomosp::remote
