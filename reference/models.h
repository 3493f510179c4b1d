// The registry of models: one line each. A file's own LOBE_MODEL enters its functions.
#pragma once

#include "models/lambert.h"
