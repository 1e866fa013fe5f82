// call: does what the button on a tag does, from the command line. Sends one CALL.
#include <CLI/CLI.hpp>
#include <iostream>

#include "beckon/call_t.hpp"
#include "common/channels.hpp"
#include "common/clock.hpp"
#include "common/message_bus.hpp"

int main(int argc, char** argv) {
  CLI::App app("Calls the robot: to a tag, to a point of the map, or back from its errand.",
               "call");
  std::string tag;
  std::vector<double> point;
  bool cancel = false;
  std::string lcm_url;
  auto* kind = app.add_option_group("what")->require_option(1);
  kind->add_option("--tag", tag, "Come to this tag, wherever it goes");
  kind->add_option("--point", point, "Go to x y, m, map frame")->expected(2);
  kind->add_flag("--cancel", cancel, "Stop and forget the call");
  app.add_option("--lcm-url", lcm_url, "LCM network")
      ->default_str(beckon::kDefaultLcmUrl)
      ->envname("LCM_DEFAULT_URL");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }

  beckon::call_t call{};
  call.utime = beckon::SystemClock().Now().utime;
  call.kind = !tag.empty()     ? beckon::call_t::TAG
              : !point.empty() ? beckon::call_t::POINT
                               : beckon::call_t::CANCEL;
  call.tag = tag;
  std::copy(point.begin(), point.end(), call.point);
  try {
    beckon::MessageBus(lcm_url.empty() ? beckon::kDefaultLcmUrl : lcm_url)
        .Publish(beckon::channels::kCall, call);
  } catch (const std::runtime_error& error) {
    std::cerr << "call: " << error.what() << "\n";
    return 1;
  }
  return 0;
}
