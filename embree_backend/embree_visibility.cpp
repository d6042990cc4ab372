#include "embree_backend/embree_visibility.h"
