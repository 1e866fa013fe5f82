// One second of a building with many tags: 100 x 100 m with rooms, 100 beacons, of which a tag
// hears those within 30 m, once a second each; locations are asked for twice a second, as the
// service does. CPU time per iteration over one second is the share of a core.
#include <benchmark/benchmark.h>

#include <cmath>
#include <random>
#include <string>

#include "services/rssi_localizer/localizer.hpp"

namespace beckon {
namespace {

Site Building() {
  Site site;
  site.name = "building";
  site.plan.max = {100.0, 100.0};
  for (int i = 1; i < 5; ++i) {
    const double at = 20.0 * i;
    for (int room = 0; room < 5; ++room) {
      const double from = 20.0 * room;
      site.plan.walls.push_back({{at, from + 2.0}, {at, from + 20.0}, std::nullopt});
      site.plan.walls.push_back({{from + 2.0, at}, {from + 20.0, at}, std::nullopt});
    }
  }
  for (int i = 0; i < 100; ++i) {
    site.beacons.push_back(
        {std::to_string(i), {5.0 + 10.0 * (i % 10), 5.0 + 10.0 * (i / 10), 2.5}});
  }
  return site;
}

void ManyTags(benchmark::State& state) {
  const Site site = Building();
  const LocalizerOptions options;
  Localizer localizer(SiteModel::Fit(site, {}, options), options);
  ManualClock clock;
  std::mt19937 random(1);
  std::uniform_real_distribution<double> anywhere(1.0, 99.0);
  std::normal_distribution<double> noise(0.0, 6.0);
  std::vector<Eigen::Vector2d> tags;
  for (int i = 0; i < state.range(0); ++i) tags.emplace_back(anywhere(random), anywhere(random));
  const auto second = [&] {
    for (const auto wait : {std::chrono::milliseconds(500), std::chrono::milliseconds(500)}) {
      clock.Advance(wait);
      benchmark::DoNotOptimize(localizer.Update(clock.Now()));
    }
    for (std::size_t tag = 0; tag < tags.size(); ++tag) {
      for (const Beacon& beacon : site.beacons) {
        const double distance = BeaconDistance(beacon, site.tag_height_m, tags[tag]);
        if (distance > 30.0) continue;
        localizer.Add({clock.Now().utime, std::to_string(tag), beacon.id,
                       options.prior.MeanRssi(distance) + noise(random)},
                      clock.Now());
      }
    }
  };
  for (int i = 0; i < 5; ++i) second();
  for (auto _ : state) second();
}
BENCHMARK(ManyTags)->Arg(100)->Arg(1000)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace beckon

BENCHMARK_MAIN();
