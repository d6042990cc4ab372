#include "hemicube_backend/hemicube_visibility.h"
