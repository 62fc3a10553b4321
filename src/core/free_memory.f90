!> How much memory this program may still take, and has taken.
module free_memory
  use, intrinsic :: iso_c_binding, only: c_int, c_size_t
  use kinds, only: wp
  implicit none
  private

  public :: free_megabytes, free_in_groups, most_megabytes

  real(wp), parameter :: kilobyte = 1024.0_wp, megabyte = 1048576.0_wp

  interface
    integer(c_int) function c_getrlimit(kind, limits) bind(C, name="getrlimit")
      import :: c_int, c_size_t
      integer(c_int), value :: kind
      integer(c_size_t), intent(out) :: limits(2)
    end function c_getrlimit
  end interface

contains

  !> The least of what the machine has to give, what `ulimit -v` leaves and what the control groups
  !! leave (containers, batch systems) [MB]. Huge where nothing is known.
  real(wp) function free_megabytes() result(megabytes)
    integer(c_int), parameter :: address_space = 9_c_int   ! of Linux
    integer(c_size_t) :: limits(2)                         ! negative: none
    real(wp) :: available, used

    megabytes = huge(megabytes)
    available = number_in("/proc/meminfo", "MemAvailable:")
    if (available >= 0.0_wp) megabytes = available*kilobyte/megabyte
    used = number_in("/proc/self/status", "VmSize:")
    if (c_getrlimit(address_space, limits) /= 0) limits = -1
    if (limits(1) >= 0 .and. used >= 0.0_wp) &
      megabytes = min(megabytes, real(limits(1), wp)/megabyte - used*kilobyte/megabyte)
    megabytes = min(megabytes, free_in_groups("/proc/self/cgroup", "/sys/fs/cgroup"))
    megabytes = max(megabytes, 0.0_wp)
  end function free_megabytes

  !> The most memory that this program has had at once [MB]; negative where that is not known.
  real(wp) function most_megabytes() result(megabytes)
    megabytes = number_in("/proc/self/status", "VmHWM:")*kilobyte/megabyte
  end function most_megabytes

  !> The least of what the control groups of a process leave, versions 1 and 2: a group has the
  !! limits of those above it, too [MB]. Huge where there is none. What the system keeps of files
  !! counts as free, as far as it was not used lately.
  real(wp) function free_in_groups(list, root) result(megabytes)
    character(*), intent(in) :: list     !! file with a line `number:controllers:group` for each
    character(*), intent(in) :: root     !! folder of the groups
    character(4096) :: line
    integer :: unit, status, first, second

    megabytes = huge(megabytes)
    open (newunit=unit, file=list, action="read", status="old", iostat=status)
    if (status /= 0) return
    do
      read (unit, "(a)", iostat=status) line
      if (status /= 0) exit
      first = index(line, ":")
      second = first + index(line(first + 1:), ":")
      if (first == 0 .or. second == first) cycle
      if (second == first + 1) then
        call look_up(trim(line(second + 1:)), root, "memory.max", "memory.current", &
                     "inactive_file ")
      else if (index(","//line(first + 1:second - 1)//",", ",memory,") > 0) then
        call look_up(trim(line(second + 1:)), root//"/memory", "memory.limit_in_bytes", &
                     "memory.usage_in_bytes", "total_inactive_file ")
      end if
    end do
    close (unit, iostat=status)

  contains

    !> A group and those above it, up to the folder of all. In a container some may not be seen.
    subroutine look_up(group, top, limit_file, use_file, cache_word)
      character(*), intent(in) :: group, top, limit_file, use_file, cache_word
      character(:), allocatable :: folder
      real(wp) :: limit, used, cached

      folder = top//group
      do
        limit = number_in(folder//"/"//limit_file, "")
        used = number_in(folder//"/"//use_file, "")
        cached = max(0.0_wp, number_in(folder//"/memory.stat", cache_word))
        if (limit >= 0.0_wp .and. used >= 0.0_wp) &
          megabytes = min(megabytes, max(0.0_wp, limit - used + cached)/megabyte)
        if (len(folder) <= len(top)) exit
        folder = folder(:index(folder, "/", back=.true.) - 1)
      end do
    end subroutine look_up
  end function free_in_groups

  !> The number behind a word in a file of the system, of the first line where there is no word;
  !! negative where there is none.
  real(wp) function number_in(file, word) result(number)
    character(*), intent(in) :: file, word
    character(200) :: line
    integer :: unit, status

    number = -1.0_wp
    open (newunit=unit, file=file, action="read", status="old", iostat=status)
    if (status /= 0) return
    do
      read (unit, "(a)", iostat=status) line
      if (status /= 0) exit
      if (index(line, word) /= 1) cycle
      read (line(len(word) + 1:), *, iostat=status) number
      if (status /= 0) number = -1.0_wp
      exit
    end do
    close (unit, iostat=status)
  end function number_in

end module free_memory
