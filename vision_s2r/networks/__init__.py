"""Networks that more than one room builds on."""
