//! The command `terrane`: see [`terrane::cli`].

fn main() -> std::process::ExitCode {
    #[cfg(all(target_os = "linux", target_env = "gnu"))]
    keep_memory();
    #[cfg(all(target_os = "linux", feature = "gpu"))]
    ask_no_screen();
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

/// Keeps Mesa from asking a screen which GPU is the best where there is no folder in which a screen's program would be found: it
/// complains of that on standard error. The GPU is chosen by what it can do anyway.
#[cfg(all(target_os = "linux", feature = "gpu"))]
#[allow(unsafe_code, reason = "Vulkan's loader reads this from the environment and from nowhere else")]
fn ask_no_screen() {
    if std::env::var_os("XDG_RUNTIME_DIR").is_none() {
        // SAFETY: no other thread runs yet that could read the environment.
        unsafe { std::env::set_var("NODEVICE_SELECT", "1") };
    }
}
