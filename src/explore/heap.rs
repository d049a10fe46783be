//! Memory that the program has freed and the allocator keeps.

/// Has the allocator give back to the system what it keeps of freed memory: pictures and land are made of very many small values, so
/// what was forgotten lies between what was not, where the C library leaves it unless it is told. Other libraries are left to
/// themselves.
pub(super) fn give_back() {
    #[cfg(all(target_os = "linux", target_env = "gnu"))]
    #[expect(unsafe_code, reason = "it is a function of the C library")]
    // SAFETY: it takes the allocator's own locks, and touches no memory that is in use.
    unsafe {
        libc::malloc_trim(0);
    }
}
