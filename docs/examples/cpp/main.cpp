// The driver of my_driver.py in C++: pursues its route and brakes for whoever is close ahead.
//
//   g++ -O2 -std=c++17 -o my_driver main.cpp
//   bridgegen search cut-in --ego exec:./my_driver        # BridgeGen starts it
//   ./my_driver 5555 &                                    # or it is a server
//   bridgegen search cut-in --ego connect:127.0.0.1:5555

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>

#include "bridgegen.hpp"

class MyDriver : public bridgegen::Driver {
 public:
  std::string name() const override { return "MyDriver in C++"; }

  void reset(std::size_t, const bridgegen::Value& scene) override {
    comfort_ = std::min(2.0, scene["max_acceleration"].number());
  }

  void act(const bridgegen::Value& seen, std::vector<double>& acceleration,
           std::vector<double>& curvature) override {
    const auto x = seen["x"].array(), y = seen["y"].array(), h = seen["h"].array();
    const auto v = seen["v"].array(), target_speed = seen["target_speed"].array();
    const auto route = seen["route"].array(), tracks = seen["tracks"].array();
    for (std::size_t i = 0; i < acceleration.size(); ++i) {
      const double cosine = std::cos(h(i)), sine = std::sin(h(i));
      // Steer through the point of the route six metres ahead (pure pursuit).
      const double dx = route(i, 3, 0) - x(i), dy = route(i, 3, 1) - y(i);
      curvature[i] = 2.0 * (dy * cosine - dx * sine) / std::max(dx * dx + dy * dy, 1.0);
      // Hold the speed, unless somebody is less than two seconds ahead.
      acceleration[i] = std::clamp(target_speed(i) - v(i), -2.0, comfort_);
      for (std::size_t j = 0; j < tracks.shape.at(1); ++j) {
        const double tx = tracks(i, j, 1) - x(i), ty = tracks(i, j, 2) - y(i);
        const double ahead = tx * cosine + ty * sine, beside = ty * cosine - tx * sine;
        const bool is_near = ahead > 0.0 && ahead < 2.0 * v(i) && std::abs(beside) < 2.0;
        if (tracks(i, j, 0) >= 2.0 && is_near) acceleration[i] = -5.0;
      }
    }
  }

 private:
  double comfort_ = 2.0;
};

int main(int argc, char** argv) {
  try {
    if (argc == 1) {
      MyDriver driver;
      return bridgegen::serve(driver);
    }
    char* end = nullptr;
    const long port = std::strtol(argv[1], &end, 10);
    if (argc > 2 || *end != '\0' || port < 1 || port > 65535)
      throw std::invalid_argument("the argument must be a port, 1 to 65535");
    return bridgegen::serve([] { return std::make_unique<MyDriver>(); },
                            static_cast<std::uint16_t>(port));
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s: %s\n", argv[0], error.what());
    return 1;
  }
}
