// Prints the shaders that it carries, and, from the folder of the target lobe::glsl, how long core.glsl is.
#include "shaders.h"

#include <fstream>
#include <iostream>
#include <iterator>
#include <string>

int main() {
    std::ifstream file(LOBE_GLSL "/core.glsl");
    const std::string core(std::istreambuf_iterator<char>(file), {});
    std::cout << core.size() << '\n' << shaders;
}
