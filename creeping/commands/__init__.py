"""The `creeping` command, one subcommand a file; the only room that joins the engine and the bodies."""
