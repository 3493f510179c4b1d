#include "python.h"

void bind_scene(nb::module_&) {}
