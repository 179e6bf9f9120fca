/* Loaded globally before pythonfmu's library, so that the call below finds this function instead of pythonfmu's own.
 *
 * pythonfmu 0.7.0 gives up its interpreter state twice when the process ends, once in a static destructor and once, by
 * this function, in the library's destructor. The second time the memory has been freed already, which corrupts the
 * heap. The static destructor alone is right.
 */
__attribute__((visibility("default"))) void finalizePythonInterpreter(void) {}
