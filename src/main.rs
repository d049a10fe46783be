//! The command `terrane`: see [`terrane::cli`].

fn main() -> std::process::ExitCode {
    #[cfg(all(target_os = "linux", target_env = "gnu"))]
    keep_memory();
    terrane::cli::run()
}

/// Makes the allocator keep what is given back.
///
/// The rasters of a tile are asked for and given back all the time. Else each goes back to the kernel, which clears its pages
/// anew: a twentieth of a bake, and more with several threads.
#[cfg(all(target_os = "linux", target_env = "gnu"))]
#[allow(unsafe_code, reason = "there is no safe way to set up the C library's allocator")]
fn keep_memory() {
    /// The most that it takes for the size from which on a block is mapped by itself.
    const MAPPED: i32 = 32 << 20;
    const TRIMMED: i32 = 512 << 20;
    // SAFETY: no other thread runs yet, and both are parameters that it knows; what it refuses changes nothing.
    unsafe {
        libc::mallopt(libc::M_MMAP_THRESHOLD, MAPPED);
        libc::mallopt(libc::M_TRIM_THRESHOLD, TRIMMED);
    }
}
