!> The runs of a batch: from a list, one command line a line, or from the decks of a folder.
module batch_list
  use text, only: string_t, to_text
  use failure, only: error_t, fail
  use text_file, only: read_source, next_line
  use system_files, only: true_path, matching_files, is_folder, is_no_file, kind_of_file
  use command_line, only: command_t, parse_arguments
  use output_files, only: base_of, result_base, file_name
  implicit none
  private

  public :: batch_run_t, read_batch, split_words

  !> One run of a batch.
  type :: batch_run_t
    type(string_t), allocatable :: words(:)    !! its command line
    type(command_t) :: command                 !! the same, taken apart
    integer :: line = 0                        !! of the list; of a folder: number of the deck
    character(:), allocatable :: text          !! the words as they were written
    character(:), allocatable :: base          !! what the paths of its files begin with
    character(:), allocatable :: result_file
  end type batch_run_t

contains

  !> Read the list, or find the decks (`*.key`) of the folder. Rejected: no run, a line that is no
  !! command line, two runs that would write one file.
  subroutine read_batch(path, runs, error)
    character(*), intent(in) :: path
    type(batch_run_t), allocatable, intent(out) :: runs(:)
    type(error_t), allocatable, intent(out) :: error

    if (is_folder(path)) then
      call take_folder(path, runs)
    else
      call take_list(path, runs, error)
    end if
    if (allocated(error)) return
    if (size(runs) == 0) then
      call fail(error, "batch '"//path//"': found no run, expected decks (*.key) in a folder, "// &
                "or a file with the words after 'igaform' of one run a line")
      return
    end if
    call check_commands(path, runs, error)
    if (.not. allocated(error)) call check_files(path, runs, error)
  end subroutine read_batch

  subroutine take_folder(path, runs)
    character(*), intent(in) :: path
    type(batch_run_t), allocatable, intent(out) :: runs(:)
    type(string_t), allocatable :: decks(:)
    integer :: i

    call matching_files(path, ".key", decks)
    allocate (runs(size(decks)))
    do i = 1, size(decks)
      allocate (runs(i)%words(1))
      runs(i)%words(1)%value = decks(i)%value
      runs(i)%text = decks(i)%value
      runs(i)%line = i
    end do
  end subroutine take_folder

  subroutine take_list(path, runs, error)
    character(*), intent(in) :: path
    type(batch_run_t), allocatable, intent(out) :: runs(:)
    type(error_t), allocatable, intent(out) :: error
    type(string_t), allocatable :: words(:)
    type(batch_run_t) :: run
    character(:), allocatable :: contents, line, reason
    integer, parameter :: longest = 10000         ! characters of a command line
    integer :: next, number

    allocate (runs(0))
    call read_source(path, contents, error)
    if (allocated(error)) then
      error%message = "batch '"//path//"': found "//error%message//", expected a list of runs, "// &
                      "one a line, or a folder of decks"
      return
    end if
    number = 0
    next = 1
    do while (next <= len(contents))
      call next_line(contents, next, line)
      number = number + 1
      reason = ""
      if (len(line) > longest) then
        reason = "a line of "//to_text(len(line))//" characters, expected at most "// &
                 to_text(longest)
      else
        call split_words(line, words, reason)
      end if
      if (reason /= "") call fail(error, location(path, number)//reason)
      if (allocated(error)) exit
      if (size(words) == 0) cycle
      run%words = words
      run%text = trim(adjustl(line))
      run%line = number
      runs = [runs, run]
    end do
  end subroutine take_list

  !> Words set apart by blanks; quotes keep blanks together, # begins a comment where a word could.
  subroutine split_words(line, words, reason)
    character(*), intent(in) :: line
    type(string_t), allocatable, intent(out) :: words(:)
    character(:), allocatable, intent(out) :: reason    !! empty: none
    type(string_t) :: word
    character(1) :: quote
    logical :: is_open
    integer :: i

    allocate (words(0))
    reason = ""
    word%value = ""
    is_open = .false.
    quote = " "
    do i = 1, len(line)
      associate (mark => line(i:i))
        if (quote /= " ") then
          if (mark == quote) then
            quote = " "
          else
            word%value = word%value//mark
          end if
        else if (mark == "'" .or. mark == '"') then
          quote = mark
          is_open = .true.
        else if (mark == " " .or. mark == achar(9) .or. mark == achar(13)) then
          if (is_open) words = [words, word]
          is_open = .false.
          word%value = ""
        else if (mark == "#" .and. .not. is_open) then
          exit
        else
          word%value = word%value//mark
          is_open = .true.
        end if
      end associate
    end do
    if (is_open) words = [words, word]
    if (quote /= " ") reason = "a quote "//quote//" that nothing closes"
  end subroutine split_words

  !> Take all command lines apart.
  subroutine check_commands(path, runs, error)
    character(*), intent(in) :: path
    type(batch_run_t), intent(inout) :: runs(:)
    type(error_t), allocatable, intent(out) :: error
    integer :: i

    do i = 1, size(runs)
      associate (run => runs(i))
        call parse_arguments(run%words, run%command)
        if (run%command%reason /= "") then
          call fail(error, location(path, run%line)//run%command%reason)
        else if (run%command%is_material .or. run%command%is_batch .or. run%command%is_check &
                 .or. run%command%is_iges .or. run%command%n_modes > 0 &
                 .or. run%command%wants_help &
                 .or. run%command%wants_version .or. run%command%wants_keywords) then
          call fail(error, location(path, run%line)//"'"//run%text//"' is no run of a deck")
        else if (is_no_file(run%command%deck)) then
          call fail(error, location(path, run%line)//"the deck '"//run%command%deck//"' is a "// &
                    kind_of_file(run%command%deck)//"; a batch reads decks more than once, so "// &
                    "they are plain files")
        end if
        if (allocated(error)) return
        run%result_file = run%command%output
        if (run%result_file == "") run%result_file = base_of(file_name(run%command%deck))//".h5"
        run%base = result_base(run%result_file)
      end associate
    end do
  end subroutine check_commands

  !> No file may be written by two runs, nor be written by one and be the deck of another, under
  !! whatever path. Files next to a result have its name without `.h5`.
  subroutine check_files(path, runs, error)
    character(*), intent(in) :: path
    type(batch_run_t), intent(in) :: runs(:)
    type(error_t), allocatable, intent(out) :: error
    type(string_t) :: bases(size(runs)), results(size(runs)), decks(size(runs))
    integer :: i, j

    do i = 1, size(runs)
      bases(i)%value = result_base(true_path(runs(i)%base//".h5"))
      results(i)%value = true_path(runs(i)%result_file)
      decks(i)%value = true_path(runs(i)%command%deck)
    end do
    do i = 1, size(runs)
      do j = 1, size(runs)
        if (j < i) then
          if (bases(i)%value == bases(j)%value .or. results(i)%value == results(j)%value &
              .or. is_beside(results(i)%value, bases(j)%value) &
              .or. is_beside(results(j)%value, bases(i)%value)) then
            call fail(error, location(path, runs(i)%line)//"the run writes '"//runs(i)%result_file &
                      //"' and files next to it, as does that of line "//to_text(runs(j)%line)// &
                      " ('"//runs(j)%result_file//"'); give one of them another --out")
            return
          end if
        end if
        if (results(i)%value /= decks(j)%value) cycle
        call fail(error, location(path, runs(i)%line)//"the result '"//runs(i)%result_file// &
                  "' is the deck of line "//to_text(runs(j)%line)//"; give another --out")
        return
      end do
    end do
  end subroutine check_files

  !> Is this result one of the files that another run writes next to its own?
  pure logical function is_beside(result_file, base)
    character(*), intent(in) :: result_file, base
    character(8), parameter :: endings(4) = [character(8) :: ".ckpt.h5", ".log", ".err", ".msg"]
    integer :: i

    is_beside = .false.
    do i = 1, size(endings)
      is_beside = is_beside .or. result_file == base//trim(endings(i))
    end do
  end function is_beside

  function location(path, line) result(text)
    character(*), intent(in) :: path
    integer, intent(in) :: line
    character(:), allocatable :: text

    text = "batch "//path//":"//to_text(line)//": "
  end function location

end module batch_list
