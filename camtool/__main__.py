"""`python -m camtool` is the same as the console script `camtool`."""

from camtool.cli.main import main

if __name__ == "__main__":
    main()
