//! Returns freed memory from the allocator to the system.

/// Makes the allocator give the memory that it holds free back to the system. Pictures and land consist of very many
/// small values, so freed ones lie scattered among used ones, and the C library keeps their memory until it is told to
/// return it. Other C libraries are left to themselves.
pub(super) fn give_back() {
    #[cfg(all(target_os = "linux", target_env = "gnu"))]
    #[expect(unsafe_code, reason = "it is a function of the C library")]
    // SAFETY: the function takes the allocator's own locks, and touches no memory that is in use.
    unsafe {
        libc::malloc_trim(0);
    }
}
