"""The limits on memory, processes and files of a submission's programs."""
#: All programs of a sandbox together may use at most this much memory. Linux limits only single
#: processes, so ResourceWatch (trial/processes.py) adds up the memory of the programs.
MAX_NODE_MEMORY_BYTES = 2 * 10 ** 9
MAX_DISK_BYTES = 300 * 10 ** 6      # the size of all files in WRITABLE_FOLDERS together
MAX_PROCESSES = 100
#: Master, robot and check together may use at most this much memory. Master, robot and check need
#: about 180 MB, and more memory if a node publishes many messages.
MAX_OTHER_MEMORY_BYTES = 600 * 10 ** 6
#: A submission's program can write at most this many bytes into a file.
MAX_FILE_BYTES = 50 * 10 ** 6
#: Each process has at most this address space. (On 64 cores numpy starts 64 threads, and reserves 3
#: GB.)
MAX_ADDRESS_SPACE_BYTES = 6 * 10 ** 9
#: All programs of a submission together have at most this many threads and processes.
MAX_THREADS_AND_PROCESSES = 500
LIMIT_FILES_COMMAND = ['prlimit', f'--fsize={MAX_FILE_BYTES}']
#: This command limits the master, the robot, the check, and the node in a sandbox.
LIMIT_COMMAND = LIMIT_FILES_COMMAND + [f'--as={MAX_ADDRESS_SPACE_BYTES}']
#: This command limits the memory [bytes] and the processor time [s] of the process that reads a
#: submission's files.
LIMIT_READER_COMMAND = ['prlimit', '--as=1000000000', '--cpu=30', '--core=0']
