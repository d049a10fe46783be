//! `terrane devices`.

use serde_json::json;

use crate::cli::console::Console;
use crate::device::Device;
use crate::error::Error;

/// Lists the devices that can compute land.
pub(super) fn run(console: &Console) -> Result<(), Error> {
    let cpu = Device::cpu_name();
    console.message(json!({ "device": "cpu", "name": cpu, "is_exact": true }), &format!("{cpu}\n"))?;
    gpus(console)
}

#[cfg(feature = "gpu")]
fn gpus(console: &Console) -> Result<(), Error> {
    use crate::device::gpu::{adapters, probe};

    let adapters = adapters();
    if adapters.is_empty() {
        return console.message(json!({ "device": "gpu", "name": null }), "no GPU, or no driver of one\n");
    }
    for adapter in adapters {
        let probed = probe(&adapter);
        let object = json!({
            "device": "gpu", "name": adapter.name(), "driver": adapter.driver(), "is_software": adapter.is_software(),
            "buffer_bytes": adapter.buffer_bytes(), "group_threads": adapter.group_threads(),
            "is_exact": probed.is_ok(), "reason": probed.as_ref().err(),
        });
        let software = if adapter.is_software() { ", a program for the CPU" } else { "" };
        let text = format!(
            "gpu, {}{software}\n  driver   {}\n  buffers  at most {} MiB\n  groups   at most {} threads\n  land     {}\n",
            adapter.name(),
            adapter.driver(),
            adapter.buffer_bytes() >> 20,
            adapter.group_threads(),
            probed.map_or_else(|reason| reason, |()| "the same bits as the CPU's".into()),
        );
        console.message(object, &text)?;
    }
    Ok(())
}

#[cfg(not(feature = "gpu"))]
fn gpus(console: &Console) -> Result<(), Error> {
    console.message(json!({ "device": "gpu", "name": null }), "no GPU: this terrane was built without them\n")
}
