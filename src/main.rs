//! The command `terrane`: see [`terrane::cli`].

fn main() -> std::process::ExitCode {
    terrane::cli::run()
}
