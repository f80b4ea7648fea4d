"""The panel at the machine: a page on this computer that moves any machine and runs its programs.

It has no protocol of its own: `session` holds the conversations of `camtool.sending` one after
another, `server` carries requests and states between it and the browser."""
