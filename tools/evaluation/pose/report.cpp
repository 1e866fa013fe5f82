#include "tools/evaluation/pose/report.hpp"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "common/text.hpp"

namespace beckon {
namespace {

// Of the finite and infinite ones; NaN where there are none.
double Quantile(std::vector<double> values, double part) {
  if (values.empty()) return std::numeric_limits<double>::quiet_NaN();
  std::sort(values.begin(), values.end());
  const auto last = static_cast<double>(values.size() - 1);
  return values[static_cast<std::size_t>(std::lround(part * last))];
}

struct SearchSummary {
  int right = 0;
  int located = 0;
  double found_m_median = 0.0, found_m_p95 = 0.0, found_s_median = 0.0;
};

SearchSummary Summarise(const std::vector<PoseDrive>& drives, Search PoseDrive::*search) {
  SearchSummary summary;
  std::vector<double> found_m, found_s;
  for (const PoseDrive& drive : drives) {
    summary.right += (drive.*search).is_right;
    summary.located += (drive.*search).is_located;
    found_m.push_back((drive.*search).found_m);
    found_s.push_back((drive.*search).found_s);
  }
  summary.found_m_median = Quantile(found_m, 0.5);
  summary.found_m_p95 = Quantile(found_m, 0.95);
  summary.found_s_median = Quantile(found_s, 0.5);
  return summary;
}

struct Summary {
  SearchSummary start, recovery;
  double error_m_median, error_m_p95, error_deg_median, error_deg_p95;
  double located_share, wrong_share;  // of all time
  double cpu_searching, cpu_located;  // means
};

Summary Summarise(const std::vector<PoseDrive>& drives) {
  Summary summary{};
  summary.start = Summarise(drives, &PoseDrive::start);
  summary.recovery = Summarise(drives, &PoseDrive::recovery);
  std::vector<double> errors_m, errors_deg;
  double time_s = 0.0, located_s = 0.0, wrong_s = 0.0;
  for (const PoseDrive& drive : drives) {
    errors_m.insert(errors_m.end(), drive.errors_m.begin(), drive.errors_m.end());
    errors_deg.insert(errors_deg.end(), drive.errors_deg.begin(), drive.errors_deg.end());
    time_s += drive.time_s;
    located_s += drive.located_s;
    wrong_s += drive.wrong_s;
    summary.cpu_searching += drive.cpu_searching / static_cast<double>(drives.size());
    summary.cpu_located += drive.cpu_located / static_cast<double>(drives.size());
  }
  summary.error_m_median = Quantile(errors_m, 0.5);
  summary.error_m_p95 = Quantile(errors_m, 0.95);
  summary.error_deg_median = Quantile(errors_deg, 0.5);
  summary.error_deg_p95 = Quantile(errors_deg, 0.95);
  summary.located_share = located_s / std::max(1e-9, time_s);
  summary.wrong_share = wrong_s / std::max(1e-9, time_s);
  return summary;
}

// JSON knows neither infinity nor NaN.
nlohmann::json Number(double value) {
  return std::isfinite(value) ? nlohmann::json(value) : nlohmann::json(nullptr);
}

nlohmann::json SearchAsJson(const Search& search) {
  return {{"right", search.is_right},          {"located", search.is_located},
          {"error_m", Number(search.error_m)}, {"error_deg", Number(search.error_deg)},
          {"driven_m", search.driven_m},       {"found_m", Number(search.found_m)},
          {"found_s", Number(search.found_s)}};
}

std::string SearchAsText(const Search& search) {
  return Format("%-8s %5.1f m %5.1f s  %5.2f m %5.1f deg",
                search.is_right     ? "right"
                : search.is_located ? "off"
                                    : "unknown",
                search.found_m, search.found_s, search.error_m, search.error_deg);
}

}  // namespace

std::string DriveAsLine(const PoseDrive& drive, const PoseDriveOptions& options) {
  std::string line = Format("%6llu  ", static_cast<unsigned long long>(drive.seed));
  line += SearchAsText(drive.start);
  if (options.is_carried) line += "   carried: " + SearchAsText(drive.recovery);
  return line + Format("  wrong %4.1f s of %5.1f s\n", drive.wrong_s, drive.time_s);
}

std::string DrivesAsTable(const std::vector<PoseDrive>& drives, const PoseDriveOptions& options) {
  const Summary summary = Summarise(drives);
  const auto search_line = [&](const char* what, double after_m, const SearchSummary& search) {
    return Format(
        "%s: %d of %zu right after %.0f m, %d off; first right after %.1f m, %.0f s "
        "(medians), %.1f m (95 %%)\n",
        what, search.right, drives.size(), after_m, search.located - search.right,
        search.found_m_median, search.found_s_median, search.found_m_p95);
  };
  std::string table = search_line("unknown start", options.find_m, summary.start);
  if (options.is_carried) {
    table += search_line("carried away", options.recover_m, summary.recovery);
  }
  return table +
         Format(
             "errors after the first %.0f m: median %.3f m, %.2f deg; 95 %% %.3f m, %.2f deg\n"
             "of all time %.1f %% with a pose, %.2f %% with a wrong one\n"
             "processor: %.1f %% of a core while searching, %.1f %% while located\n",
             options.find_m, summary.error_m_median, summary.error_deg_median, summary.error_m_p95,
             summary.error_deg_p95, 100.0 * summary.located_share, 100.0 * summary.wrong_share,
             100.0 * summary.cpu_searching, 100.0 * summary.cpu_located);
}

std::string DrivesAsJson(const std::vector<PoseDrive>& drives, const PoseDriveOptions& options) {
  const Summary summary = Summarise(drives);
  const auto search = [](const SearchSummary& s) {
    return nlohmann::json{{"right", s.right},
                          {"located", s.located},
                          {"found_m_median", Number(s.found_m_median)},
                          {"found_m_p95", Number(s.found_m_p95)},
                          {"found_s_median", Number(s.found_s_median)}};
  };
  nlohmann::json json = {{"drives", drives.size()},
                         {"start", search(summary.start)},
                         {"error_m_median", Number(summary.error_m_median)},
                         {"error_m_p95", Number(summary.error_m_p95)},
                         {"error_deg_median", Number(summary.error_deg_median)},
                         {"error_deg_p95", Number(summary.error_deg_p95)},
                         {"located_share", summary.located_share},
                         {"wrong_share", summary.wrong_share},
                         {"cpu_searching", summary.cpu_searching},
                         {"cpu_located", summary.cpu_located},
                         {"runs", nlohmann::json::array()}};
  if (options.is_carried) json["recovery"] = search(summary.recovery);
  for (const PoseDrive& drive : drives) {
    nlohmann::json run = {{"seed", drive.seed},
                          {"start", SearchAsJson(drive.start)},
                          {"time_s", drive.time_s},
                          {"located_s", drive.located_s},
                          {"wrong_s", drive.wrong_s}};
    if (options.is_carried) run["recovery"] = SearchAsJson(drive.recovery);
    json["runs"].push_back(run);
  }
  return json.dump() + "\n";
}

}  // namespace beckon
