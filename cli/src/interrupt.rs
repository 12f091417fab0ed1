//! Ctrl-C and polite requests to end: what is not finished is removed first.

/// From now on SIGINT and SIGTERM end this program as they always do, but leave no unfinished file behind.
#[cfg(unix)]
pub(crate) fn leave_nothing_behind() -> std::io::Result<()> {
    use signal_hook::consts::{SIGINT, SIGTERM};
    let mut signals = signal_hook::iterator::Signals::new([SIGINT, SIGTERM])?;
    std::thread::spawn(move || {
        // The first ends the program.
        if let Some(signal) = signals.forever().next() {
            cdpr_fmu_build::unfinished::remove_all_and(|| {
                // Ended by the signal, as a shell wants to know; if that fails, with the code that stands for it.
                let _ = signal_hook::low_level::emulate_default_handler(signal);
                std::process::exit(128 + signal);
            });
        }
    });
    Ok(())
}

#[cfg(not(unix))]
pub(crate) fn leave_nothing_behind() -> std::io::Result<()> {
    Ok(())
}
