// A driver in C++ for BridgeGen: reads and writes the messages of its protocol, version 1.
// C++17 and POSIX, little-endian; no libraries. protocol.json in BridgeGen's package describes the
// messages. Errors that are thrown while a driver answers fail the scenario, not the search.

#pragma once

#include <algorithm>
#include <arpa/inet.h>
#include <array>
#include <cerrno>
#include <csignal>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <fcntl.h>
#include <functional>
#include <memory>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <stdexcept>
#include <string>
#include <string_view>
#include <sys/socket.h>
#include <unistd.h>
#include <utility>
#include <vector>

#if defined(__BYTE_ORDER__) && __BYTE_ORDER__ != __ORDER_LITTLE_ENDIAN__
#error "lengths and arrays are little-endian, and this machine is not"
#endif

namespace bridgegen {

constexpr std::uint64_t kProtocol = 1;
constexpr std::size_t kMaxFrame = 64u << 20;
constexpr std::size_t kMaxItems = 5'000'000;  // of all lists and maps of a message
constexpr std::size_t kMaxRows = kMaxFrame / 32;
constexpr int kMaxDepth = 16;

struct Array;

/// A value of msgpack; texts and bytes are in the message's buffer.
struct Value {
  enum class Kind { kNil, kBool, kInteger, kReal, kText, kBytes, kList, kMap };
  Kind kind = Kind::kNil;
  std::int64_t integer = 0;
  double real = 0.0;
  std::string_view text;
  std::vector<Value> list;
  std::vector<std::pair<std::string_view, Value>> map;

  /// Returns the value of a key.
  const Value& operator[](std::string_view key) const {
    for (const auto& [name, value] : map)
      if (name == key) return value;
    throw std::runtime_error("the message has no '" + std::string(key) + "'");
  }
  double number() const {
    if (kind == Kind::kInteger) return static_cast<double>(integer);
    if (kind == Kind::kReal) return real;
    throw std::runtime_error("the message must have a number here");
  }
  std::size_t size() const {
    if (kind != Kind::kInteger || integer < 0) throw std::runtime_error("a size must be >= 0");
    return static_cast<std::size_t>(integer);
  }
  /// Returns an array, whose elements are in the message's buffer.
  Array array() const;
};

/// An array in C order; its elements are in the message's buffer, and are read as doubles, whatever
/// their type.
struct Array {
  std::vector<std::size_t> shape;
  std::string_view dtype, data;

  double operator()(std::size_t i) const {
    if (dtype == "float64") return element<double>(i);
    if (dtype == "float32") return static_cast<double>(element<float>(i));
    if (dtype == "int64") return static_cast<double>(element<std::int64_t>(i));
    if (dtype == "int32") return element<std::int32_t>(i);
    if (dtype == "int8") return element<std::int8_t>(i);
    if (dtype == "bool") return element<std::int8_t>(i) != 0;
    throw std::runtime_error("an array of an unknown type");
  }
  double operator()(std::size_t i, std::size_t j, std::size_t k) const {
    if (shape.size() != 3 || i >= shape[0] || j >= shape[1] || k >= shape[2])
      throw std::runtime_error("an array has no element of these indices");
    return (*this)((i * shape[1] + j) * shape[2] + k);
  }

 private:
  template <class T>
  T element(std::size_t i) const {
    if (i >= data.size() / sizeof(T)) throw std::runtime_error("an array is too short");
    T value;
    std::memcpy(&value, data.data() + i * sizeof(T), sizeof(T));
    return value;
  }
};

inline Array Value::array() const {
  constexpr std::array<std::pair<std::string_view, std::size_t>, 6> sizes{
      {{"float64", 8}, {"float32", 4}, {"int64", 8}, {"int32", 4}, {"int8", 1}, {"bool", 1}}};
  Array found;
  found.dtype = (*this)["dtype"].text;
  found.data = (*this)["data"].text;
  const auto known = std::find_if(sizes.begin(), sizes.end(),
                                  [&](const auto& one) { return one.first == found.dtype; });
  if (known == sizes.end()) throw std::runtime_error("an array of an unknown type");
  std::size_t bytes = known->second;
  for (const Value& n : (*this)["shape"].list) {
    found.shape.push_back(n.size());
    if (found.shape.back() > kMaxFrame || bytes > kMaxFrame)
      throw std::runtime_error("an array is too large");
    bytes *= found.shape.back();
  }
  if (bytes != found.data.size()) throw std::runtime_error("an array has not the size of its shape");
  return found;
}

/// What drives N scenarios at once; see docs/drivers.md of BridgeGen.
class Driver {
 public:
  virtual ~Driver() = default;
  virtual std::string name() const = 0;
  virtual std::vector<std::string> wants() const { return {}; }
  virtual void reset(std::size_t n, const Value& scene) = 0;
  /// Fills in the acceleration [m/s^2] and the curvature [1/m] of each scenario.
  virtual void act(const Value& observation, std::vector<double>& acceleration,
                   std::vector<double>& curvature) = 0;
};

namespace detail {

class Reader {
 public:
  explicit Reader(std::string_view data) : data_(data) {}

  Value message() {
    Value found = read(0);
    if (!data_.empty()) throw std::runtime_error("more follows the message's end");
    return found;
  }

 private:
  Value read(int depth) {
    using Kind = Value::Kind;
    const unsigned tag = static_cast<unsigned char>(take(1)[0]);
    if (tag < 0x80) return whole(tag);
    if (tag >= 0xe0) return whole(static_cast<std::int64_t>(tag) - 0x100);
    if (tag < 0x90) return items(Kind::kMap, tag & 0x0f, depth);
    if (tag < 0xa0) return items(Kind::kList, tag & 0x0f, depth);
    if (tag < 0xc0) return bytes(Kind::kText, tag & 0x1f);
    switch (tag) {
      case 0xc0: return {};
      case 0xc2: case 0xc3: { Value v = whole(tag & 1); v.kind = Kind::kBool; return v; }
      case 0xc4: case 0xc5: case 0xc6: return bytes(Kind::kBytes, big(1u << (tag - 0xc4)));
      case 0xca: { const auto bits = static_cast<std::uint32_t>(big(4)); return real<float>(bits); }
      case 0xcb: return real<double>(big(8));
      case 0xcc: case 0xcd: case 0xce: case 0xcf: {
        const std::uint64_t found = big(1u << (tag - 0xcc));
        if (found > INT64_MAX) throw std::runtime_error("a whole number is too large");
        return whole(static_cast<std::int64_t>(found));
      }
      case 0xd0: return whole(static_cast<std::int8_t>(big(1)));
      case 0xd1: return whole(static_cast<std::int16_t>(big(2)));
      case 0xd2: return whole(static_cast<std::int32_t>(big(4)));
      case 0xd3: return whole(static_cast<std::int64_t>(big(8)));
      case 0xd9: case 0xda: case 0xdb: return bytes(Kind::kText, big(1u << (tag - 0xd9)));
      case 0xdc: case 0xdd: return items(Kind::kList, big(2u << (tag - 0xdc)), depth);
      case 0xde: case 0xdf: return items(Kind::kMap, big(2u << (tag - 0xde)), depth);
      default: throw std::runtime_error("the message is no msgpack, or has an extension");
    }
  }

  std::string_view take(std::size_t n) {
    if (n > data_.size()) throw std::runtime_error("the message ends too early");
    const std::string_view found = data_.substr(0, n);
    data_.remove_prefix(n);
    return found;
  }
  std::uint64_t big(std::size_t n) {
    std::uint64_t found = 0;
    for (const char one : take(n)) found = found << 8 | static_cast<unsigned char>(one);
    return found;
  }
  static Value whole(std::int64_t value) {
    Value found;
    found.kind = Value::Kind::kInteger;
    found.integer = value;
    return found;
  }
  template <class T, class Bits>
  static Value real(Bits bits) {
    T value;
    std::memcpy(&value, &bits, sizeof(value));
    Value found;
    found.kind = Value::Kind::kReal;
    found.real = static_cast<double>(value);
    return found;
  }
  Value bytes(Value::Kind kind, std::size_t n) {
    Value found;
    found.kind = kind;
    found.text = take(n);
    return found;
  }
  Value items(Value::Kind kind, std::size_t n, int depth) {
    if (depth >= kMaxDepth || n > left_)
      throw std::runtime_error("the message has too many parts, or is nested too deeply");
    left_ -= n;
    Value found;
    found.kind = kind;
    for (std::size_t i = 0; i < n; ++i) {
      if (kind == Value::Kind::kList) {
        found.list.push_back(read(depth + 1));
        continue;
      }
      const Value key = read(depth + 1);
      if (key.kind != Value::Kind::kText) throw std::runtime_error("a key must be a text");
      found.map.emplace_back(key.text, read(depth + 1));
    }
    return found;
  }

  std::string_view data_;
  std::size_t left_ = kMaxItems;
};

inline void put_big(std::string& out, int tag, std::uint64_t value, int n) {
  out += static_cast<char>(tag);
  while (n-- > 0) out += static_cast<char>(value >> (8 * n));
}
inline void put(std::string& out, std::string_view text) {
  put_big(out, 0xdb, text.size(), 4);
  out += text;
}
inline void put(std::string& out, const std::vector<double>& values) {
  out += '\x83';
  put(out, "dtype"), put(out, "float64"), put(out, "shape");
  out += '\x91';
  put_big(out, 0xcf, values.size(), 8);
  put(out, "data");
  put_big(out, 0xc6, values.size() * sizeof(double), 4);
  out.append(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(double));
}
inline std::string error(std::string_view message) {
  std::string out = "\x82", text(message.substr(0, 500));
  for (char& one : text)  // a text in the message must be UTF-8
    if (static_cast<unsigned char>(one) >= 0x80) one = '?';
  put(out, "type"), put(out, "error"), put(out, "message"), put(out, text);
  return out;
}

inline std::string answer(Driver& driver, const Value& message, std::size_t& n) {
  const std::string_view type = message["type"].text;
  std::string out;
  if (type == "hello") {
    out += '\x84';
    put(out, "type"), put(out, "hello"), put(out, "protocol");
    put_big(out, 0xcf, kProtocol, 8);
    put(out, "name"), put(out, driver.name()), put(out, "wants");
    const std::vector<std::string> wants = driver.wants();
    put_big(out, 0xdc, wants.size(), 2);
    for (const std::string& one : wants) put(out, one);
  } else if (type == "reset") {
    n = message["n"].size();
    if (n > kMaxRows) throw std::runtime_error("too many scenarios at once");
    driver.reset(n, message["scene"]);
    out += '\x81';
    put(out, "type"), put(out, "ready");
  } else if (type == "act") {
    std::vector<double> acceleration(n), curvature(n);
    driver.act(message["observation"], acceleration, curvature);
    out += '\x83';
    put(out, "type"), put(out, "control"), put(out, "acceleration"), put(out, acceleration);
    put(out, "curvature"), put(out, curvature);
  } else {
    throw std::runtime_error("a message of an unknown type");
  }
  return out;
}

inline bool read_all(int file, char* to, std::size_t n) {
  while (n > 0) {
    const ssize_t got = ::read(file, to, n);
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) return false;
    to += got, n -= static_cast<std::size_t>(got);
  }
  return true;
}
inline bool write_all(int file, const char* from, std::size_t n) {
  while (n > 0) {
    const ssize_t put = ::write(file, from, n);
    if (put < 0 && errno == EINTR) continue;
    if (put <= 0) return false;
    from += put, n -= static_cast<std::size_t>(put);
  }
  return true;
}

/// Answers messages until the other end closes the stream.
inline void converse(Driver& driver, int in, int out) {
  std::signal(SIGPIPE, SIG_IGN);  // a closed stream ends the loop, not the process
  std::string data;
  std::size_t n = 0;
  for (std::uint32_t length; read_all(in, reinterpret_cast<char*>(&length), 4);) {
    if (length > kMaxFrame) return;
    data.resize(length);
    if (!read_all(in, data.data(), length)) return;
    std::string frame(4, '\0');
    try {
      frame += answer(driver, Reader(data).message(), n);
    } catch (const std::exception& raised) {
      frame += error(raised.what());
    } catch (...) {
      frame += error("the driver threw something that is no std::exception");
    }
    const auto size = static_cast<std::uint32_t>(frame.size() - 4);
    std::memcpy(frame.data(), &size, 4);
    if (!write_all(out, frame.data(), frame.size())) return;
  }
}

}  // namespace detail

/// Serves a driver over standard input and output; what it prints goes to the standard error.
inline int serve(Driver& driver) {
  const int in = ::dup(0), out = ::dup(1), nothing = ::open("/dev/null", O_RDONLY);
  if (in < 0 || out < 0 || nothing < 0) throw std::runtime_error("the streams cannot be copied");
  ::dup2(nothing, 0);
  ::dup2(2, 1);
  detail::converse(driver, in, out);
  return 0;
}

namespace detail {

/// Serves one connection in a process of its own; returns its exit status.
inline int attend(const std::function<std::unique_ptr<Driver>()>& make, int connection) {
  std::signal(SIGCHLD, SIG_DFL);
  const int on = 1;
  ::setsockopt(connection, IPPROTO_TCP, TCP_NODELAY, &on, sizeof(on));
  int status = 0;
  try {
    converse(*make(), connection, connection);
  } catch (const std::exception& raised) {
    std::fprintf(stderr, "the driver cannot be made: %s\n", raised.what());
    status = 1;
  }
  std::fflush(nullptr);
  return status;
}

}  // namespace detail

/// Serves drivers on a port of this machine, each connection in a process of its own.
inline int serve(const std::function<std::unique_ptr<Driver>()>& make, std::uint16_t port) {
  const int listener = ::socket(AF_INET, SOCK_STREAM, 0), on = 1;
  if (listener < 0) throw std::runtime_error("there is no socket to be had");
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(port);
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  ::setsockopt(listener, SOL_SOCKET, SO_REUSEADDR, &on, sizeof(on));
  if (::bind(listener, reinterpret_cast<const sockaddr*>(&address), sizeof(address)) != 0 ||
      ::listen(listener, 16) != 0) {
    ::close(listener);
    throw std::runtime_error("the port cannot be listened on");
  }
  std::signal(SIGCHLD, SIG_IGN);
  while (true) {
    const int connection = ::accept(listener, nullptr, nullptr);
    if (connection < 0) {
      if (errno == EINTR || errno == ECONNABORTED) continue;
      ::close(listener);
      throw std::runtime_error("connections cannot be accepted any more");
    }
    std::fflush(nullptr);  // or the other process would print it again
    if (::fork() == 0) {
      ::close(listener);
      ::_exit(detail::attend(make, connection));
    }
    ::close(connection);
  }
}

}  // namespace bridgegen
