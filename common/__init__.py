"""What every part of the program uses: errors, validation of files, writing of files, runs under mpirun."""
