//! The command `terrane`: see [`terrane::cli`].

fn main() -> std::process::ExitCode {
    #[cfg(all(target_os = "linux", target_env = "gnu"))]
    keep_memory();
    #[cfg(all(target_os = "linux", feature = "gpu"))]
    ask_no_screen();
    terrane::cli::run()
}

/// Makes the allocator keep freed memory.
///
/// The rasters of tiles are allocated and freed all the time. By default each goes back to the kernel, which clears its
/// pages when they are used again: a twentieth of a bake's time, and more with several threads.
#[cfg(all(target_os = "linux", target_env = "gnu"))]
#[allow(unsafe_code, reason = "there is no safe way to set up the C library's allocator")]
fn keep_memory() {
    /// The largest value that the allocator accepts for the size in bytes from which a block is mapped by itself.
    const MAPPED: i32 = 32 << 20;
    const TRIMMED: i32 = 512 << 20;
    // SAFETY: no other thread runs yet, and the C library knows both parameters; a value that it refuses changes
    // nothing.
    unsafe {
        libc::mallopt(libc::M_MMAP_THRESHOLD, MAPPED);
        libc::mallopt(libc::M_TRIM_THRESHOLD, TRIMMED);
    }
}

/// Keeps Mesa from asking a display which GPU is the best if there is no runtime folder in which Mesa would look for
/// one: Mesa complains of that on standard error. The program chooses the GPU by its abilities anyway.
#[cfg(all(target_os = "linux", feature = "gpu"))]
#[allow(unsafe_code, reason = "Vulkan's loader reads this from the environment and from nowhere else")]
fn ask_no_screen() {
    if std::env::var_os("XDG_RUNTIME_DIR").is_none() {
        // SAFETY: no other thread runs yet that could read the environment.
        unsafe { std::env::set_var("NODEVICE_SELECT", "1") };
    }
}
