// Where a lobe should look for the light of an environment.
#pragma once

#include "light.h"
#include "proposal.h"

#include <vector>

namespace lobe {

// For axes all over the sphere, how an environment's tiles are drawn from by a lobe that reflects about them: by their
// light, times what a lobe of that breadth does with it. No lobe is known as well as to itself; whoever draws so weighs
// what comes by the density, and chooses among a few.
class Outlook {
    static constexpr int ACROSS = 16;  // axes of a face of the cube
    static constexpr std::size_t AXES = 6 * ACROSS * ACROSS;

public:
    static constexpr std::size_t BYTES = AXES * sizeof(Environment::Aim);

    Outlook(const Environment& environment, int breadth);

    // Of a lobe's draws, in steps, so that lobes which are nearly as broad have one outlook.
    static int breadth(const Proposal& proposal);

    const Environment::Aim& about(const Vec3& axis) const { return aims_[place(axis)]; }

private:
    static std::size_t place(const Vec3& axis);
    static Vec3 axis(std::size_t place);

    std::vector<Environment::Aim> aims_;
};

}  // namespace lobe
