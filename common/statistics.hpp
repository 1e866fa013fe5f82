// Of lists of numbers. All are NaN for an empty one.
#pragma once

#include <vector>

namespace beckon {

double Mean(const std::vector<double>& values);
// About their own mean, over all of them.
double StandardDeviation(const std::vector<double>& values);
// The value below which a share of the values lie, by linear interpolation.
double Quantile(std::vector<double> values, double share);

}  // namespace beckon
