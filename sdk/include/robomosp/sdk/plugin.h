/* SPDX-License-Identifier: Apache-2.0
 * The plugin entry: one C function returning constant data (layer: contract).
 * A plugin is a shared library that exports rmp_plugin_entry_v1. Everything the host needs to
 * decide whether to trust the C++ interfaces behind it (ABI tag, versions, parameter tables) is
 * plain C data that can be read before any C++ of the plugin runs. Plugins are never unloaded. */
#pragma once

#include <stdint.h>

/** Number of the vocabulary that all interfaces share: the tables below, Result, Error, Params,
 *  Progress and the types of types.h. Interfaces have their own numbers ("robomosp.ik/1"): one
 *  that changes takes the next, the host still supports the one before, and no plugin of another
 *  interface notices. How structs grow without either number:
 *  - those with `struct_size` at their end; whoever reads a field that came later asks for it first
 *    (RMP_HAS);
 *  - rows of tables here: the tables have the length of a row;
 *  - elements of other arrays and spans in their `room`, or in parallel arrays;
 *  - interfaces through `extension(id)`, behind the destructor of each: a pointer to what the id
 *    names, or NULL if it is not known.
 *  What a plugin makes and hands over by value never grows. */
#define RMP_SDK_ABI 1
/** Version of the SDK's source interface, semantic. */
#define RMP_SDK_VERSION "0.2.0"

#define RMP_STR_(x) #x
#define RMP_STR(x) RMP_STR_(x)

/** Whether a struct made elsewhere reaches as far as this field. */
#define RMP_HAS(pointer, field)                                 \
  ((const char*)&(pointer)->field + sizeof((pointer)->field) <= \
   (const char*)(pointer) + (pointer)->struct_size)

#ifdef __cplusplus
#include <cstdint>
#include <version>
/* Both GCC and clang follow the Itanium C++ ABI here, whatever their versions. */
#if defined(__GXX_ABI_VERSION) && !defined(_MSC_VER)
#define RMP_ABI_CXX ";itanium"
#else
#define RMP_ABI_CXX ";unknown"
#endif
#if defined(__GLIBCXX__) && defined(_GLIBCXX_USE_CXX11_ABI)
#define RMP_ABI_LIBRARY ";libstdc++;cxx11=" RMP_STR(_GLIBCXX_USE_CXX11_ABI)
#elif defined(_LIBCPP_ABI_VERSION)
#define RMP_ABI_LIBRARY ";libc++;abi=" RMP_STR(_LIBCPP_ABI_VERSION)
#else
#define RMP_ABI_LIBRARY ";unknown"
#endif
#if defined(_GLIBCXX_DEBUG)
#define RMP_ABI_DEBUG ";debug"
#else
#define RMP_ABI_DEBUG ""
#endif
/** What must be equal in host and plugin for C++ objects to cross: the SDK's vocabulary, the C++
 *  ABI, the C++ library with its strings and its debug mode. Not the compiler, its version, the
 *  language standard or optimisation: those make the same objects. */
#define RMP_ABI_TAG "rmp" RMP_STR(RMP_SDK_ABI) RMP_ABI_CXX RMP_ABI_LIBRARY RMP_ABI_DEBUG
extern "C" {
#endif

#if defined(__GNUC__)
#define RMP_EXPORT __attribute__((visibility("default")))
#else
#define RMP_EXPORT
#endif

#ifdef __cplusplus
#define RMP_DEFAULT_0 = 0
#define RMP_DEFAULT_NULL = nullptr
#else
#define RMP_DEFAULT_0
#define RMP_DEFAULT_NULL
#endif

/** rmp_param::flags: may be left out though it has no default; see Params::has(). */
#define RMP_OPTIONAL 1u

/** One row of a parameter table. All constant data. */
typedef struct rmp_param {
  const char* name; /**< lower_snake */
  const char* type; /**< bool int real string enum pose path real[] ref:<kind> */
  const char* unit; /**< SI unit of a real or real[] ("m", "rad", "m/s"); "" when dimensionless */
  const char* doc;  /**< one sentence */
  /** As the user would type it ("5 mm"); NULL = required, or left out with RMP_OPTIONAL. */
  const char* default_text;
  const char* choices;          /**< "a|b|c" for an enum, else NULL */
  double min, max;              /**< inclusive range of an int or real; min > max = unbounded */
  uint32_t flags RMP_DEFAULT_0; /**< RMP_OPTIONAL */
  const char* label RMP_DEFAULT_NULL; /**< shown for the name: "Damping"; NULL = the name */
  const char* group RMP_DEFAULT_NULL; /**< heading it is shown under; NULL = none */
} rmp_param;

/** A program that a provider has run in a separate process, so that a crash, a hang or a memory
 *  bomb in it harms nothing else. The functions are called on the calling thread, and may be
 *  NULL except `output`; none may throw. */
typedef struct rmp_program {
  uint32_t struct_size;
  /** A file in <prefix>/libexec/robomosp, or an absolute path. */
  const char* name;
  const char* const* arguments; /**< without the program's name */
  uint32_t argument_count;
  const char* input; /**< goes to its standard input; input_size bytes */
  uint64_t input_size;
  double seconds;       /**< it is killed after this time [s] */
  uint64_t memory;      /**< greatest address space [bytes] */
  uint64_t most_output; /**< greatest size of its standard output [bytes] */
  void* context;        /**< first argument of what follows */
  void (*output)(void* context, const char* bytes, uint64_t size); /**< once, when all went well */
  void (*line)(void* context, const char* text, uint64_t size);    /**< of standard error */
  int32_t (*cancelled)(void* context); /**< not 0 = kill it; asked some 20 times a second */
} rmp_program;

/** What the host offers to every provider, from its making on (C++: a constructor that takes it).
 *  Made by the host; may grow at the end. */
typedef struct rmp_host {
  uint32_t struct_size;
  const char* program_version;
  /** severity: 0 debug, 1 info, 2 warning, 3 error. [any thread] */
  void (*log)(int32_t severity, const char* source, const char* text);
  /** Runs a program to its end. 0 = it went well; 1 = cancelled; else `error` (a sentence, cut at
   *  error_size bytes) reports how it ended: missing, exit code, crash, limit. [any thread; blocks]
   */
  int32_t (*run)(const rmp_program* program, char* error, uint32_t error_size);
  /** Makes a provider of any plugin: NULL or "" = the default one. Give it to whoever owns it as a
   *  pointer to the class of the interface: its virtual destructor deletes it. NULL = `error`
   * gives the reason. [any thread] */
  void* (*create)(const char* interface_id, const char* name, char* error,
                  uint32_t error_size)RMP_DEFAULT_NULL;
  /** Calls `take` for every enabled provider of an interface. [any thread] */
  void (*list)(const char* interface_id, void* context,
               void (*take)(void* context, const char* name, const char* tags)) RMP_DEFAULT_NULL;
  /** What later versions of the program offer, by its id; NULL = not known. [any thread] */
  const void* (*extension)(const char* id)RMP_DEFAULT_NULL;
} rmp_host;

/** One implementation of one interface. All constant data. */
typedef struct rmp_provider {
  const char* interface_id; /**< "robomosp.ik/1" */
  const char* name;         /**< lower_snake, unique within its interface */
  const char* summary;      /**< one sentence */
  const char* tags;         /**< capability words, comma-separated: "closed_form,serial,dof=6" */
  const rmp_param* params;  /**< read it with rmp_param_at: rows of older plugins are shorter */
  uint32_t param_count;
  uint32_t param_size; /**< sizeof(rmp_param) as the plugin was compiled */
  /** Makes one instance (a pointer to the C++ interface class named by interface_id; the host
   *  deletes it through its virtual destructor), or returns NULL and fills `error`. */
  void* (*create)(const rmp_host* host, char* error, uint32_t error_size);
} rmp_provider;

/** What the entry function returns. `struct_size` lets it grow at the end. */
typedef struct rmp_plugin {
  uint32_t struct_size;
  const char* abi_tag; /**< RMP_ABI_TAG as the plugin was compiled */
  const char* id;      /**< reverse-domain: "org.example.my_ik" */
  const char* version;
  const char* license; /**< SPDX identifier */
  const char* summary;
  const rmp_provider* providers; /**< read it with rmp_provider_at */
  uint32_t provider_count;
  uint32_t provider_size; /**< sizeof(rmp_provider) as the plugin was compiled */
} rmp_plugin;

typedef const rmp_plugin* (*rmp_plugin_entry_fn)(void);

#ifdef __cplusplus
}  // extern "C"

#include <algorithm>
#include <cstddef>
#include <cstdio>
#include <cstring>
#include <exception>
#include <type_traits>

/// A row of a parameter table; what its plugin did not know of is zero.
[[nodiscard]] inline rmp_param rmp_param_at(const rmp_provider& provider, std::uint32_t i) {
  rmp_param row{};
  std::memcpy(static_cast<void*>(&row),
              reinterpret_cast<const char*>(provider.params) +
                  static_cast<std::size_t>(i) * provider.param_size,
              std::min<std::size_t>(provider.param_size, sizeof row));
  return row;
}
/// A row of a plugin's table of providers.
[[nodiscard]] inline const rmp_provider& rmp_provider_at(const rmp_plugin& plugin,
                                                         std::uint32_t i) {
  return *reinterpret_cast<const rmp_provider*>(reinterpret_cast<const char*>(plugin.providers) +
                                                static_cast<std::size_t>(i) * plugin.provider_size);
}

namespace robomosp::detail {
/// Makes a provider and keeps every exception inside the plugin. One that is made from a
/// `const rmp_host*` gets it: it may log, run programs and ask other providers as long as it lives.
template <class T>
void* create_provider(const rmp_host* host, char* error, std::uint32_t error_size) {
  try {
    if constexpr (std::is_constructible_v<T, const rmp_host*>)
      return static_cast<typename T::Interface*>(new T(host));
    else return static_cast<typename T::Interface*>(new T());
  } catch (const std::exception& e) {
    if (error && error_size) std::snprintf(error, error_size, "%s", e.what());
  } catch (...) {
    if (error && error_size) std::snprintf(error, error_size, "%s", "unknown exception");
  }
  return nullptr;
}
template <std::uint32_t N>
constexpr std::uint32_t table_size(const rmp_param (&)[N]) {
  return N;
}
}  // namespace robomosp::detail

#ifdef RMP_LAZY_DOOR
#include <robomosp/sdk/lazy_door.h>
#define RMP_CREATE_ robomosp::detail::create_later
#else
#define RMP_CREATE_ robomosp::detail::create_provider
#endif

/// One provider row: class, name, summary, tags, parameter table (an array of rmp_param).
#define RMP_PROVIDER(Class, name, summary, tags, table)                             \
  rmp_provider {                                                                    \
    Class::Interface::kInterfaceId, name, summary, tags, table,                     \
        robomosp::detail::table_size(table), sizeof(rmp_param), &RMP_CREATE_<Class> \
  }
/// The same for a provider without parameters.
#define RMP_PROVIDER_NO_PARAMS(Class, name, summary, tags)                              \
  rmp_provider {                                                                        \
    Class::Interface::kInterfaceId, name, summary, tags, nullptr, 0, sizeof(rmp_param), \
        &RMP_CREATE_<Class>                                                             \
  }

/// Defines the entry point: id, version, SPDX licence, summary, then the provider rows.
#define RMP_PLUGIN(id, version, license, summary, ...)                        \
  extern "C" RMP_EXPORT const rmp_plugin* rmp_plugin_entry_v1(void) {         \
    static const rmp_provider providers[] = {__VA_ARGS__};                    \
    static const rmp_plugin plugin = {                                        \
        sizeof(rmp_plugin),                                                   \
        RMP_ABI_TAG,                                                          \
        id,                                                                   \
        version,                                                              \
        license,                                                              \
        summary,                                                              \
        providers,                                                            \
        static_cast<std::uint32_t>(sizeof(providers) / sizeof(providers[0])), \
        sizeof(rmp_provider)};                                                \
    return &plugin;                                                           \
  }
#endif
