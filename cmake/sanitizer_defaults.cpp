// What every program of an AddressSanitizer build is linked with: findings in libraries that are not ours to mend, passed over by name, so that
// a finding that remains is ours.

extern "C" {

/// Fast DDS 2.9 frees its history pools by a base class's size (RTPSReader, RTPSWriter).
const char* __asan_default_options();
const char* __asan_default_options() { return "new_delete_type_mismatch=0"; }

/// Mesa's software driver keeps 240 bytes for each context that was ever open.
const char* __lsan_default_suppressions();
const char* __lsan_default_suppressions() { return "leak:swrast_dri.so\nleak:libEGL_mesa.so\nleak:libGLX_mesa.so\n"; }

/// A driver stays loaded: LeakSanitizer cannot name (nor pass over) a library that has gone by the time it looks.
int dlclose(void* handle);
int dlclose(void*) { return 0; }

}  // extern "C"
