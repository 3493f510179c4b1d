// The registry of models: one line each. A file's own LOBE_MODEL enters its functions.
#pragma once

#include "models/ashikhmin_shirley.h"
#include "models/beckmann.h"
#include "models/blend.h"
#include "models/blinn_phong.h"
#include "models/core.h"
#include "models/energy.h"
#include "models/fresnel.h"
#include "models/gaussian.h"
#include "models/ggx.h"
#include "models/lafortune.h"
#include "models/lambert.h"
#include "models/masking.h"
#include "models/oren_nayar.h"
#include "models/schlick.h"
#include "models/ward.h"
