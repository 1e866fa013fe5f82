#include "common/odometry_frame.hpp"

#include <gtest/gtest.h>

#include "common/ego_motion.hpp"

namespace beckon {
namespace {

constexpr MotionLimits kLimits{.speed_mps = 1.0, .turn_radps = 2.0};
constexpr Utime kStart = 1'700'000'000'000'000;

bool IsAnother(const Pose2& last, const Pose2& pose, double elapsed_s) {
  return IsAnotherFrame({kStart, last}, kStart + UtimeFromSeconds(elapsed_s), pose, kLimits);
}

TEST(OdometryFrame, GoesOnWhileTheBaseCouldHaveMovedSo) {
  EXPECT_FALSE(IsAnother({0.3, 0.1, 0.2}, {0.34, 0.1, 0.29}, 0.05));
  EXPECT_FALSE(IsAnother({0.3, 0.1, 0.2}, {1.1, 0.1, 0.2}, 1.0)) << "messages were lost";
  EXPECT_FALSE(IsAnother({0.3, 0.1, 3.1}, {0.3, 0.1, -3.1}, 0.05));
  EXPECT_FALSE(IsAnother({0.3, 0.1, 0.2}, {0.2, 0.1, 0.2}, -0.1)) << "one that comes late";
  EXPECT_FALSE(IsAnother({0.2, 0.0, 0.0}, {0.1, 0.0, 0.0}, 0.2)) << "straight back";
}

TEST(OdometryFrame, EndsWhereNoBaseMovesSo) {
  EXPECT_TRUE(IsAnother({0.3, 0.1, 0.2}, {0.5, 0.1, 0.2}, 0.05));
  EXPECT_TRUE(IsAnother({0.3, 0.1, 0.2}, {0.3, 0.1, 0.4}, 0.05));
  EXPECT_TRUE(IsAnother({3.0, 0.1, 0.2}, {0.5, 0.1, 0.2}, 60.0)) << "it stops in silence";
  EXPECT_TRUE(IsAnother({0.3, 0.1, 0.2}, {0.3, 0.1, 0.2}, -1.5)) << "a log played again";
}

// While a base boots for seconds, its speed would explain any of this.
TEST(OdometryFrame, EndsWhereABaseBeginsAnewNearItsOrigin) {
  EXPECT_TRUE(IsAnother({0.3, 0.1, 0.2}, {0.0, 0.0, 0.0}, 5.0));
  EXPECT_TRUE(IsAnother({0.02, 0.01, 0.2}, {0.0, 0.0, 0.0}, 5.0)) << "turned only";
  EXPECT_TRUE(IsAnother({0.4, 0.1, 0.2}, {0.15, 0.0, 0.0}, 5.0)) << "of the camera, not the axle";
  EXPECT_FALSE(IsAnother({0.02, 0.01, 0.02}, {0.0, 0.0, 0.0}, 5.0)) << "as good as the old one";
}

TEST(EgoMotion, DoesNotSpanTheRestartOfABase) {
  EgoMotion motion;
  motion.AddOdometry(kStart, {0.3, 0.1, 0.2});
  motion.AddOdometry(kStart + UtimeFromSeconds(2.0), {});
  EXPECT_FALSE(motion.Between(kStart, kStart + UtimeFromSeconds(2.0)));
  EXPECT_FALSE(motion.Between(kStart + UtimeFromSeconds(1.0), kStart + UtimeFromSeconds(2.0)));
}

}  // namespace
}  // namespace beckon
